"""The page, served on this computer alone."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable

import uvicorn

from pamrs.errors import ParameterError
from pamrs.studio._app import make_app
from pamrs.studio._folder import Studio


def serve(studio: Studio, port: int = 0, *, ready: Callable[[str], object] = print) -> None:
    """Serve the page until Ctrl-C; a diagnosis that goes on then is ended.

    Parameters
    ----------
    studio : Studio
        The case folder.
    port : int
        On 127.0.0.1; 0 takes a free one.
    ready : callable
        Gets the address, with its token, once it is open.

    Raises
    ------
    ParameterError
        If the port is taken, or none.
    """
    try:
        listening = socket.create_server(("127.0.0.1", port))
    except (OSError, OverflowError) as error:
        why = getattr(error, "strerror", None) or error
        raise ParameterError(f"port = {port}: cannot be opened on 127.0.0.1 ({why})") from error
    token = secrets.token_urlsafe(32)
    config = uvicorn.Config(
        make_app(studio, token),
        log_level="error",
        access_log=False,
        lifespan="off",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    with listening:
        ready(f"http://127.0.0.1:{listening.getsockname()[1]}/?token={token}")
        try:
            uvicorn.Server(config).run(sockets=[listening])
        except KeyboardInterrupt:
            pass
        finally:
            studio.close()
