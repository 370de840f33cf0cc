"""Files of other formats, which no format may take for its own."""

from pathlib import Path

import pytest

from places import FILES as SHARED_FILES


@pytest.fixture(scope="session")
def shared_files() -> list[Path]:
    if not SHARED_FILES.is_dir():
        pytest.skip(f"no files at {SHARED_FILES}")
    return [path for path in sorted(SHARED_FILES.rglob("*")) if path.is_file()]
