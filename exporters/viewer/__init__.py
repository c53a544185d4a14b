"""The viewer with one scene: files for any static host, or one HTML file that needs no host at all."""

from exporters.viewer.bundle import write_viewer_bundle, write_viewer_html, write_viewer_zip

__all__ = ["write_viewer_bundle", "write_viewer_html", "write_viewer_zip"]
