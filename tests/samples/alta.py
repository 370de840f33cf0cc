"""Text files of ALTA in its parametrisations and outputs."""

from pathlib import Path

TEXTS = {
    "by_difference": (
        "#DIM 3 1\n#PARAM_IN  ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n# material: a test\n"
        "0.5\t0.25\t3.14159265358979\t0.125\n0.75 0.25 -1.5 0.5\n-0.5 0.25 0 0.0625\n"
    ),
    "spherical": (
        "#DIM 4 3\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT RGB_COLOR\n"
        "0.1 0 0.2 3.1 0.1 0.2 0.3\n0.1 1.5 0.2 4.6 0.4 0.5 0.6\n"
    ),
    "half_width": (
        "#DIM 3 1\n#VS 1\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 0.3 1 0.1\n1.5 1.5 0.1 2 0.5\n"
    ),
    "ends": "#DIM 2 1\n#VS 2\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 1 0.9 1.2\n0.3 0.4 2 1 4\n",
    "cosine": (
        "#DIM 3 1\n#PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI\n#PARAM_OUT INV_STERADIAN_COSINE_FACTOR\n"
        "0.1 0.2 0.3 0.5\n\n0.1 0 1.5707963267948966 0.1\n"
    ),
    "vectors": "#DIM 6 1\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n0.6 0 0.8 -0.6 0 0.8 1\n0 0 1 0 0.6 0.8 2\n",
    "half_turned": "#DIM 4 1\n#PARAM_IN RUSIN_TH_PH_TD_PD\n#PARAM_OUT INV_STERADIAN\n0.1 0.5 0.2 0.3 1\n",
    "cosines": "#DIM 2 2\r\n#PARAM_IN COS_TH_TD\r\n#PARAM_OUT INV_STERADIAN\r\n0.9 0.8 1 2\r\n1 1 3 4\r\n",
    "normal_light": "#DIM 2 1\n#PARAM_IN ISOTROPIC_TV_PROJ_DPHI\n#PARAM_OUT INV_STERADIAN\n0.5 0.5 1\n1.5 1.5 2\n",
}


def samples(folder: Path) -> list[Path]:
    paths = []
    for name, text in TEXTS.items():
        paths.append(folder / f"{name}.alta")
        paths[-1].write_bytes(text.encode())
    return paths
