"""Names that a shell completes on the command line, listed when it asks for them."""

from collections.abc import Iterable


def models() -> Iterable[str]:
    """The models of the catalogue."""
    from gonio import catalogue

    return catalogue


def models_or_groups() -> Iterable[str]:
    """The models, and the words for several of them."""
    return ["family", "all", *models()]


def symmetry_or_models() -> Iterable[str]:
    """What may fill gaps."""
    return ["symmetry", *models()]


def formats_written() -> Iterable[str]:
    """The formats that can be written."""
    from gonio.formats import formats

    return [one.name for one in formats().values() if one.write]


def materials() -> Iterable[str]:
    """The materials whose optical constants come with gonio."""
    from gonio.materials import materials

    return materials


def surfaces() -> Iterable[str]:
    """The surfaces whose constants a paper prints."""
    from gonio.models.publications import published

    return published


def samples() -> Iterable[str]:
    """The bundled scans."""
    from gonio.samples import samples

    return samples()


def public_files() -> Iterable[str]:
    """The collections of public data, and their files."""
    from gonio.archive import collections

    for name, collection in collections().items():
        yield name
        yield from (f"{name}/{file}" for file in collection.files)


def targets() -> Iterable[str]:
    """The programs that models are written for."""
    from gonio.exporting import targets

    return [one.name for one in targets().values() if not one.refused]
