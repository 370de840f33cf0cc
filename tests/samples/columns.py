"""Files of five columns: in plane as lumos has them, all round with commas, and with a turned surface."""

from pathlib import Path

TEXTS = {
    "in_plane": "# material: a test\n# lambda = 532 nm\n#\n# phi_i  theta_i  phi_o  theta_o  brdf\n"
    + "".join(
        f"{i:.2f}     -180.00     {r:.2f}     0.00     {1e-3 * (r + 91):.5e}\n"
        for i in (5, 60)
        for r in range(-90, 91, 30)
    ),
    "all_round": "10,0,20,45.5,0.125\r\n10,0,20,90,0.25 # a remark\r\n10,0,20,180,nan\r\n\r\n30,0,0,0,1e-3\r\n",
    "turned": "10 0 20 180 0.5\n10 90 20 270 0.75\n-10 45 20 -45 0.625\n",
}


def samples(folder: Path) -> list[Path]:
    paths = []
    for name, text in TEXTS.items():
        paths.append(folder / f"{name}.dat")
        paths[-1].write_bytes(text.encode())
    return paths
