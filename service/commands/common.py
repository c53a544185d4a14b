"""Arguments that several commands share."""

import argparse
import logging
from dataclasses import replace
from pathlib import Path

from service.formats import FORMATS
from service.options import Options
from service.settings import ServiceSettings

# Documented here and in the API's form alike; the defaults live in Options.
CHOICES = {
    "preset": "draft, balanced or high",
    "device": "auto, cpu, cuda or cuda:N",
    "seed": "of everything random",
    "downscale": "reduce the photos by this whole factor",
    "max-size-px": "reduce the photos to this longest side at most",
    "background": "white, black or #rrggbb, behind transparent pixels",
    "scene-kind": "auto, object, forward or unbounded",
    "formats": f"what to export beside scene.glb: all, or some of {','.join(FORMATS)}",
}
FLAGS = {"skip-missing": "leave out photos that the poses name but the capture lacks"}


def add_options(parser: argparse.ArgumentParser, **defaults: str) -> None:
    """Adds what may be chosen for a conversion."""
    for name, text in CHOICES.items():
        parser.add_argument(f"--{name}", help=text, default=defaults.get(name, ""))
    for name, text in FLAGS.items():
        parser.add_argument(f"--{name}", help=text, action="store_const", const="true", default="")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the preset")


def form_words(arguments: argparse.Namespace) -> dict[str, str]:
    """The choices as the API's form fields."""
    names = [name.replace("-", "_") for name in (*CHOICES, *FLAGS)]
    chosen = {name: getattr(arguments, name) for name in names}
    return {name: text for name, text in chosen.items() if text}


def options_of(arguments: argparse.Namespace) -> Options:
    """The choices, checked.

    Raises:
        UnknownPreset, OptionInvalid
    """
    return Options.from_text(form_words(arguments), arguments.set)


def add_service(parser: argparse.ArgumentParser) -> None:
    """Adds what the server and its workers must agree on."""
    parser.add_argument("--data", type=Path, default=Path("data"), help="folder of everything that is written")
    parser.add_argument(
        "--database-url", default="", help="of the job engine; default: an SQLite file in the data folder"
    )
    parser.add_argument("--keep-days", type=float, help="delete ended jobs after so many days; default: never")
    parser.add_argument("--log-level", choices=["debug", "info", "warning", "error"], default="info")


def start_log(arguments: argparse.Namespace, who: str) -> None:
    """Sends the log of this process to stderr."""
    form = f"%(asctime)s {who} %(levelname)s %(message)s"
    logging.basicConfig(level=arguments.log_level.upper(), format=form)


def settings_of(arguments: argparse.Namespace, worker_id: str = "") -> ServiceSettings:
    settings = ServiceSettings(data=arguments.data, database_url=arguments.database_url, keep_days=arguments.keep_days)
    return replace(settings, worker_id=worker_id) if worker_id else settings
