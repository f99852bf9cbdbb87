"""A Dask scheduler that somebody else runs: where it is, and how each side knows the other."""

from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import urlsplit

from distributed import Security

from core.errors import InputError

_ENCRYPTED = ("tls", "wss")


@dataclass(frozen=True, slots=True)
class RemoteScheduler:
    """The scheduler at ``address``.

    ``tls_ca``, ``tls_cert`` and ``tls_key`` are PEM files, as those of ``dask scheduler``; what is
    None comes from Dask's own configuration, and the key may stand in the file of the certificate.
    Those who reach a scheduler without TLS can run code in it, in its workers and in us. So one
    that is not on this machine is refused, unless ``is_insecure`` insists on it.
    """

    address: str
    tls_ca: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None
    is_insecure: bool = False

    def __post_init__(self) -> None:
        """Check it; raises `InputError`."""
        if self.is_encrypted:
            self._check_certificates()
            return
        if self.tls_ca or self.tls_cert or self.tls_key:
            raise InputError(
                "scheduler", f"{self.address} has no use for certificates; did you mean tls://?"
            )
        if not self.is_insecure and not self._is_on_loopback:
            raise InputError(
                "scheduler",
                f"{self.address} is not encrypted: anyone on the network could run code there and "
                "here. Start it with --tls-ca-file, --tls-cert and --tls-key, and name it "
                "tls://HOST:PORT with --tls-ca, --tls-cert and --tls-key; or insist with "
                "--insecure-scheduler",
            )

    @property
    def is_encrypted(self) -> bool:
        """Whether both sides prove who they are."""
        return self.address.partition("://")[0].lower() in _ENCRYPTED

    @property
    def warning(self) -> str | None:
        """What the user should know of it; None if nothing."""
        if self.is_encrypted:
            return None
        whoever = "every user of this machine" if self._is_on_loopback else "anyone on its network"
        return (
            f"note: the scheduler at {self.address} has no TLS: {whoever} can run code in it, in "
            "its workers and in this process"
        )

    def security(self) -> Security:
        """What Dask connects with."""
        if not self.is_encrypted:
            return Security(require_encryption=False)
        files = {
            "tls_ca_file": self.tls_ca,
            "tls_client_cert": self.tls_cert,
            "tls_client_key": self.tls_key,
        }
        given = {name: str(path) for name, path in files.items() if path is not None}
        return Security(require_encryption=True, **given)

    @property
    def _is_on_loopback(self) -> bool:
        try:
            host = urlsplit("//" + self.address.rpartition("://")[2]).hostname or ""
            return host == "localhost" or ip_address(host).is_loopback
        except ValueError:
            return False

    def _check_certificates(self) -> None:
        security = self.security()
        found = security.get_tls_config_for_role("client")
        if not found["ca_file"] or not found["cert"]:
            raise InputError(
                "scheduler",
                f"{self.address} needs certificates: give --tls-ca, --tls-cert and --tls-key, or "
                "set them in Dask's configuration",
            )
        try:
            security.get_connection_args("client")
        except OSError as error:  # a missing file, or one that holds something else
            raise InputError(
                "scheduler", f"the certificates of {self.address} cannot be used: {error}"
            ) from None
