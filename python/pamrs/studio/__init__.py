"""A local page for a rig and its logs: rig, data, check, run, result, next experiment.

`Studio` is what the page shows and does with one case folder, `make_app` the page as an ASGI
application, `serve` runs it for one user on this computer. It needs the extra ``studio``.
"""

from pamrs.studio._app import make_app
from pamrs.studio._folder import Studio
from pamrs.studio._server import serve

__all__ = ["Studio", "make_app", "serve"]
