"""The same scene in fewer bytes: exactly (`repacked`), or within a bound of its colours (`compacted`)."""

from exporters.compaction.compaction import PHONE, WEB, Quality, compacted, repacked

__all__ = ["PHONE", "WEB", "Quality", "compacted", "repacked"]
