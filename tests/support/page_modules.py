"""What browser tests ask the page's own modules (``assets/web/modules``)."""


def in_module(path: str, expression: str) -> str:
    """JavaScript: ``expression`` about ``module``, the one that the page itself has loaded."""
    return (
        f'import(new URL("{path}", document.querySelector("script[type=module][src]").src))'
        f".then((module) => {expression})"
    )
