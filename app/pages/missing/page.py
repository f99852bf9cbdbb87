"""The page for an address that names nothing."""

from dash import dcc, html


def layout(problem: str) -> html.Div:
    """Say what is wrong with the address and where to go on."""
    return html.Div(
        [
            html.H1("Nothing here"),
            html.P(problem),
            html.P(
                [
                    dcc.Link("Fly a new flight", href="/"),
                    " or look through the ",
                    dcc.Link("stored runs", href="/runs"),
                    ".",
                ]
            ),
        ],
        className="panel message-page",
    )
