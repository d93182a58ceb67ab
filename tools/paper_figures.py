"""Draw Figures 13 to 16 of Li, Tang and Wang (2015) from a run of their two prisms.

    .venv/bin/python tools/paper_figures.py RESULTS FOLDER    # FOLDER/two-prisms-13.png to -16.png

RESULTS is the folder of a run in the plane with frames and rows of the blocks "i" and
"j" at every 0.5 ms, as verification/two-scale-prisms/scene.toml makes them.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import picture
from picture import pyplot

FIELD = "velocity:x"
# Instants of the paper's snapshots, s; before the touch it names only the first and
# the last.
SNAPSHOTS = {13: [0.0, 0.1665, 0.333], 14: [0.3335, 0.334, 0.34], 15: [0.3405, 0.496]}
# Part of the collision in the picture, m: the region of small elements.
WINDOW = ((-2.4, -2.6), (5.0, 2.6))
# One scale for all; in the middle of it, what two equal blocks have as one.
SCHEME = ("coolwarm", 0.0, 3.0)
# Colours that a picture is left with: the book stays small.
COLOURS = 255
# Part of Figure 16 in the enlarged plot, s.
CLOSE = (0.330, 0.345)


def draw_snapshots(results, number, file):
    """Draw the snapshots of a figure, coloured by velocity."""
    wanted = SNAPSHOTS[number]
    chosen = picture.choose(picture.series(results), len(wanted), wanted)
    for instant, (time, _) in zip(wanted, chosen):
        if abs(time - instant) > 1e-6:
            raise picture.Mistake(f"no frame at {instant:g} s, the nearest is at {time:g} s: frame_interval = 5e-4")
    frames = [picture.read(time, frame, FIELD) for time, frame in chosen]
    window = WINDOW if number == 14 else None
    picture.draw_snapshots(frames, FIELD, file, f"tools/paper_figures.py, Figure {number}", window, SCHEME)


def shrink(file):
    """Write a picture anew with few colours."""
    drawn = Image.open(file)
    known = PngInfo()
    known.add_text("Description", drawn.text["Description"])
    drawn.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True, pnginfo=known)


def displacements(results):
    """Times, s, and how far the centre of each block has gone along x, m."""
    places = {}
    with open(results / "blocks.csv", newline="") as table:
        for row in csv.DictReader(table):
            places.setdefault(row["block"], []).append((float(row["time"]), float(row["x"])))
    if not {"i", "j"} <= places.keys():
        raise picture.Mistake(f"{results / 'blocks.csv'} has no rows of the blocks i and j")
    return {block: np.array(places[block]) - [0.0, places[block][0][1]] for block in "ij"}


def draw_displacements(results, file):
    """Draw how both blocks move over time, and the collision once more, enlarged."""
    figure, panels = pyplot.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
    for block, rows in displacements(results).items():
        (line,) = panels[0].plot(*rows.T, label=f"block {block}", linewidth=1.4)
        near = rows[(rows[:, 0] > CLOSE[0] - 1e-6) & (rows[:, 0] < CLOSE[1] + 1e-6)]
        panels[1].plot(1e3 * near[:, 0], 1e3 * (near[:, 1] - near[0, 1]), ".-", color=line.get_color(), linewidth=1.0)
    panels[0].set(xlabel="time, s", ylabel="displacement along x, m")
    panels[0].legend(frameon=False)
    panels[1].set(xlabel="time, ms", ylabel=f"the same since {1e3 * CLOSE[0]:g} ms, mm")
    figure.savefig(file, dpi=150, metadata={"Description": "tools/paper_figures.py, Figure 16"})
    pyplot.close(figure)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="folder of a run")
    parser.add_argument("folder", type=Path, help="where the pictures go")
    wanted = parser.parse_args(arguments)
    try:
        for number in (13, 14, 15, 16):
            file = wanted.folder / f"two-prisms-{number}.png"
            if number in SNAPSHOTS:
                draw_snapshots(wanted.results, number, file)
            else:
                draw_displacements(wanted.results, file)
            shrink(file)
    except picture.Mistake as mistake:
        print(f"paper_figures.py: {mistake}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
