"""Addresses of sockets: loopback unless told; TLS and a token where others may reach them."""

from __future__ import annotations

import ssl
from hmac import compare_digest
from typing import Any, final

from attrs import frozen

from vedette import fields
from vedette.errors import InputError
from vedette_files.input_files import user_path as _path

LOOPBACK = "127.0.0.1"
PATIENCE = 0.2
"""s that a socket is waited for before the service looks whether it is to stop."""
NO_ROOM = "connection not taken"
REST = 0.05
"""s until a connection is asked for again that the system cannot give, as all its open files are used."""


def host_field(doc: str) -> Any:
    """Declare an address, by default this machine alone."""
    return fields.text(doc, default=LOOPBACK)


def port_field() -> Any:
    """Declare a port."""
    return fields.integer("number of the port", at_least=1, at_most=65535)


@final
@frozen
class Security:
    """TLS, and a token that a client sends as its first line. Files are in PEM."""

    certificate: str = fields.text("file of the server's certificate and its chain", default="")
    key: str = fields.text("file of the certificate's private key", default="")
    authority: str = fields.text("file of the authorities that a client trusts; default: those of the system", default="")
    token_file: str = fields.text("file that holds the token; default: none is asked for", default="")

    @property
    def token(self) -> bytes | None:
        """The token, or None; InputError if its file cannot be read or is empty."""
        if not self.token_file:
            return None
        try:
            with _path(self.token_file).open("rb") as file:
                content = file.read(4097).strip()
        except OSError as error:
            raise InputError(f"token_file: {self.token_file}: cannot be read: {error.strerror}") from None
        if not 16 <= len(content) <= 4096 or b"\n" in content:
            raise InputError(f"token_file: {self.token_file}: must hold one line of 16 to 4,096 bytes")
        return content

    def allows(self, line: bytes) -> bool:
        """Return whether a client's first line is the token."""
        token = self.token
        return token is None or compare_digest(line.strip(), token)

    def server(self) -> ssl.SSLContext | None:
        """Return what wraps a server's connections; None where it has no certificate."""
        if not self.certificate:
            return None
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        try:
            context.load_cert_chain(_path(self.certificate), _path(self.key) if self.key else None)
        except (OSError, ssl.SSLError) as error:
            raise InputError(f"certificate: {self.certificate}: cannot be used: {error}") from None
        return context

    def client(self) -> ssl.SSLContext:
        """Return what wraps a client's connection."""
        try:
            return ssl.create_default_context(cafile=_path(self.authority) if self.authority else None)
        except (OSError, ssl.SSLError) as error:
            raise InputError(f"authority: {self.authority}: cannot be used: {error}") from None
