"""The HTTP API. It enqueues and reports; it never trains."""

import mimetypes
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles

from service import problems
from service.database import prepare
from service.jobs import Jobs
from service.routes import router
from service.settings import ServiceSettings


def create_app(settings: ServiceSettings) -> FastAPI:
    """The application of one installation. A worker must run for jobs to proceed.

    `app.state.settings` and, while it runs, `app.state.jobs` are what the routes use.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        prepare(settings)
        app.state.jobs = Jobs(settings)
        yield
        app.state.jobs.close()

    app = FastAPI(
        title="Polyfield",
        description="Photos in, a .glb with view-dependent appearance out.",
        lifespan=lifespan,
        # FastAPI's own pages load their scripts from elsewhere; /openapi.json says the same.
        docs_url=None,
        redoc_url=None,
    )
    app.state.settings = settings
    problems.install(app)
    app.include_router(router)
    _mount_viewer(app, settings)
    return app


def _mount_viewer(app: FastAPI, settings: ServiceSettings) -> None:
    if settings.viewer is None:
        return
    # Some systems map .js to text/plain, which browsers refuse as a module.
    mimetypes.add_type("text/javascript", ".js")
    three = settings.viewer / "node_modules" / "three"
    app.mount("/vendor/three", StaticFiles(directory=three, check_dir=False), name="three")
    app.mount("/", StaticFiles(directory=settings.viewer, html=True, check_dir=False), name="viewer")
