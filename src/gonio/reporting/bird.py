"""What can be said of a measurement beside its values: the keys of BiRD's universal format, and what a report asks.

The names are those of its metadata schema, version 1.0 (EMPIR 16NRM08, brdf_json_schema_v1.0.json and the files that it
refers to). Its `adhoc_section` may hold anything, and is where the items stand that a report asks for and BiRD has no
key for, such as how stray light was subtracted.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

ANYTHING = "adhoc_section"  # a key below which every key is allowed
TEXT: Mapping[str, Any] = {}  # of a key that has none below it
QUANTITY = dict.fromkeys(("value", "unit", "uncertainty", "uncertainty_unit"), TEXT)
RANGE = dict.fromkeys(("min_value", "max_value", "unit"), TEXT)
REMARKS = dict.fromkeys(("data_links", "comments", ANYTHING), TEXT)
THING = dict.fromkeys(("name", "model", "manufacturer"), TEXT) | REMARKS


def _texts(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names, TEXT)


def _quantities(*names: str) -> dict[str, Any]:
    return dict.fromkeys(names, QUANTITY)


_DIMENSIONS = (
    _quantities("length", "width", "height", "thickness", "radius", "diameter", "semi_major_axis", "semi_minor_axis")
    | _quantities("area")
    | _texts("comments", ANYTHING)
)
_PLACE = _texts("country", "county", "city", "street", "building_nr", "room_nr", "postal_code", "coordinates")
_PROVENANCE = _texts("organization", "website", "email", "phone", "contact_person", "comments") | {"location": _PLACE}
_APERTURE = THING | _texts("material", "type", "shape") | {"dimensions": _DIMENSIONS}
_MATERIAL = (
    _texts("name", "chemical_formula", "type", "layer_number")
    | _quantities("refractive_index_wl", "refractive_index", "extinction_coefficient_wl", "extinction_coefficient")
    | REMARKS
)
_SAMPLE = (
    THING
    | _texts("type", "manufacturing_method", "treatment", "cleaning_procedure", "front_surface_finish")
    | _texts("back_surface_finish", "shape", "origin_location", "zero_azimuth_location", "properties_symmetry")
    | _quantities("front_surface_roughness", "back_surface_roughness", "front_surface_curvature")
    | _quantities("back_surface_curvature", "specular_reflectance", "specular_transmittance", "total_reflectance")
    | _quantities("total_transmittance", "temperature")
    | {"provenance": _PROVENANCE, "materials": _MATERIAL, "dimensions": _DIMENSIONS}
)
_SOURCE = (
    THING
    | _texts("type", "CIE_notation")
    | _quantities("power", "central_wl", "color_temperature", "operating_temperature", "operating_current")
    | _quantities("operating_voltage")
    | {"wl_range": RANGE}
)
_FILTER = (
    THING
    | _texts("type", "material")
    | _quantities("cut_on_wl", "cut_off_wl", "central_wl", "transmittance_FWHM", "avg_transmittance")
    | _quantities("min_transmittance", "max_transmittance", "blocking_avg", "min_blocking", "max_blocking")
    | _quantities("damage_threshold")
    | {"wl_range": RANGE}
)
_SETTING = (
    _texts("selected_dispersive_element", "comments", ANYTHING)
    | _quantities("spectral_resolution", "slit_width", "bandpass_FWHM", "central_wl_uncertainty", "selected_wl")
    | {"wl_range": RANGE}
)
_SELECTORS = _texts("comments", ANYTHING) | {
    "optical_filters": _FILTER,
    "monochromator": THING | _texts("type") | _quantities("damage_threshold") | {"settings": _SETTING},
}
_POLARISER = (
    THING
    | _texts("material", "type")
    | _quantities("extinction_ratio", "design_wl", "damage_threshold")
    | {"wl_range": RANGE}
)
_BEAM = _texts("shape") | _quantities("uniformity", "divergence") | {"dimensions": _DIMENSIONS} | REMARKS
_SENSOR = (
    THING
    | _texts("type", "material", "shape")
    | _quantities("responsivity_wl", "responsivity", "linearity_wl", "linearity", "uniformity", "dark_signal")
    | _quantities("bias_voltage", "damage_threshold", "operating_temperature")
    | {"dimensions": _DIMENSIONS, "spectral_response_range": RANGE, "power_range": RANGE}
)
_OPTICS = {"wavelength_selectors": _SELECTORS, "polarization_alterants": _POLARISER, "aperture": _APERTURE}
_ILLUMINATION = THING | _OPTICS | {"source": _SOURCE, "beam": _BEAM}
_DETECTION = (
    THING
    | _OPTICS
    | _quantities("distance_from_sample", "solid_angle")
    | {"sensors": _SENSOR, "viewed_area": _texts("shape") | {"dimensions": _DIMENSIONS}}
)
_REFERENCE = THING | _texts("type", "material", "shape") | _quantities("solid_angle") | {"dimensions": _DIMENSIONS}
_INSTRUMENT = (
    THING
    | _texts("serial_number", "firmware_version", "operation_type", "operator_name")
    | {"illumination_system": _ILLUMINATION, "detection_system": _DETECTION, "reference_info": _REFERENCE}
)
_SOFTWARE = _texts("name", "version", "author", "description", "simulation_model") | REMARKS

KEYS: Mapping[str, Any] = (
    _texts("schema", "id", "type", "timestamp", "description", "method")
    | REMARKS
    | {
        "provenance": _PROVENANCE,
        "license": _texts("type", "link", "rights_holder", "email", "phone", "proprietary"),
        "instrumentation": _INSTRUMENT,
        "software": _SOFTWARE,
        "sample": _SAMPLE,
        "environment": _quantities("temperature", "relative_humidity", "pressure") | REMARKS,
    }
)


class Item(NamedTuple):
    """One thing that a report says or lists as not stated: its label, and the keys that state it, any of which will do.

    Keys are joined by dots, and a list on the way is looked through.
    """

    label: str
    keys: tuple[str, ...]


def _items(**texts: str) -> tuple[Item, ...]:
    return tuple(Item(label.replace("_", " "), tuple(keys.split())) for label, keys in texts.items())


_I, _L, _D = "instrumentation", "instrumentation.illumination_system", "instrumentation.detection_system"
IDENTIFICATION: Sequence[Item] = _items(
    report_number="adhoc_section.report_number",
    identifier_of_the_data="id",
    description="description",
    time_of_the_measurement="timestamp",
    organisation="provenance.organization",
    operator=f"{_I}.operator_name",
    contact="provenance.contact_person provenance.email",
    licence="license.type",
    holder_of_the_rights="license.rights_holder",
)
SAMPLE: Sequence[Item] = _items(
    name="sample.name",
    material="sample.materials sample.type",
    manufacturer="sample.manufacturer",
    model_or_batch="sample.model",
    treatment_and_finish="sample.treatment sample.front_surface_finish sample.manufacturing_method",
    size="sample.dimensions",
    mark_of_zero_azimuth="sample.zero_azimuth_location",
    place_that_was_measured="sample.origin_location",
    cleaning="sample.cleaning_procedure",
    storage="sample.adhoc_section.storage",
    photograph="sample.adhoc_section.photograph",
)
INSTRUMENT: Sequence[Item] = _items(
    instrument=f"{_I}.name",
    maker=f"{_I}.manufacturer",
    model=f"{_I}.model",
    serial_number=f"{_I}.serial_number",
    source=f"{_L}.source",
    wavelength=f"{_L}.source.central_wl {_L}.wavelength_selectors.optical_filters.central_wl "
    f"{_L}.wavelength_selectors.monochromator.settings.selected_wl {_L}.source.wl_range",
    bandwidth=f"{_L}.wavelength_selectors.monochromator.settings.bandpass_FWHM "
    f"{_L}.wavelength_selectors.optical_filters.transmittance_FWHM",
    size_of_the_beam=f"{_L}.beam.dimensions",
    divergence_of_the_beam=f"{_L}.beam.divergence",
    incident_polarisation=f"{_L}.polarization_alterants {_L}.adhoc_section.polarisation",
    aperture_of_the_detector=f"{_D}.aperture",
    distance_of_the_detector=f"{_D}.distance_from_sample",
    solid_angle_of_the_detector=f"{_D}.solid_angle",
    viewed_area=f"{_D}.viewed_area",
    polarisation_at_the_detector=f"{_D}.polarization_alterants {_D}.adhoc_section.polarisation",
    overfill_or_underfill=f"{_I}.adhoc_section.overfill",
    angular_resolution_and_uncertainty=f"{_I}.adhoc_section.angular_resolution",
    alignment=f"{_I}.adhoc_section.alignment",
)
METHOD: Sequence[Item] = _items(
    absolute_or_relative=f"{_I}.operation_type",
    reference_standard=f"{_I}.reference_info",
    certificate_and_traceability=f"{_I}.reference_info.adhoc_section.certificate",
    subtraction_of_blank_and_stray_light=f"{_I}.adhoc_section.stray_light",
    instrument_signature=f"{_I}.adhoc_section.instrument_signature",
    noise_equivalent_BRDF=f"{_I}.adhoc_section.noise_equivalent_brdf",
    averaging_and_repeats=f"{_I}.adhoc_section.averaging",
)
ENVIRONMENT: Sequence[Item] = _items(
    temperature="environment.temperature sample.temperature",
    relative_humidity="environment.relative_humidity",
    cleanliness_class="environment.adhoc_section.cleanliness_class",
)
