"""The pages' one dependency: pinned, and taken from nowhere but the package manager's own registry."""

import json
import re

from tests.browser.site import VIEWER


def test_every_dependency_is_pinned_exactly() -> None:
    package = json.loads((VIEWER / "package.json").read_text())
    versions = {**package["dependencies"], **package["devDependencies"]}
    assert all(re.fullmatch(r"\d+\.\d+\.\d+(-[\w.]+)?", version) for version in versions.values())


def test_lock_has_checksums_and_names_no_host() -> None:
    text = (VIEWER / "package-lock.json").read_text()
    packages = {name: entry for name, entry in json.loads(text)["packages"].items() if name}
    assert packages
    assert all(entry["integrity"].startswith("sha512-") for entry in packages.values())
    assert "://" not in text


def test_pages_load_nothing_from_other_hosts() -> None:
    sources = [*VIEWER.glob("*.html"), *VIEWER.glob("css/*.css"), *VIEWER.glob("js/*.js")]
    assert len(sources) > 20
    for source in sources:
        addresses = [a for a in re.findall(r"https?://[^\s\"'<>)]+", source.read_text()) if "w3.org" not in a]
        assert addresses == [], source.name
