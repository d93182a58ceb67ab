"""The picture maker, on two triangles that fly apart."""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import meshio
import numpy as np
from matplotlib import image
from PIL import Image

import picture

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"

HISTORY = """step,time,kinetic_energy,strain_energy,impact_loss,friction_loss,energy_residual
0,0.0,10.0,0.0,0.0,0.0,0.0
1,0.1,8.0,1.5,0.25,0.25,0.0
"""


def write_run(folder, times=(0.0, 0.1, 0.2)):
    """A results folder: two triangles, the right one moving at 3 m/s."""
    (folder / "frames").mkdir()
    rest = np.array([[0, 0, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0], [2, 0, 0]], float)
    velocity = np.zeros((6, 3))
    velocity[3:] = [3.0, 4.0, 0.0]
    entries = []
    for number, time in enumerate(times):
        meshio.Mesh(
            rest + time * velocity,
            [("triangle", np.array([[0, 1, 2], [3, 5, 4]]))],
            point_data={"velocity": velocity},
            cell_data={"stress": [np.array([[-1.0, 0, 0, 0, 0, 0], [2.0, 7, 0, 0, 0, 0]])], "level": [np.array([0, 1])]},
        ).write(folder / "frames" / f"{number:05}.vtu")
        entries.append(f'<DataSet timestep="{time}" file="frames/{number:05}.vtu"/>')
    (folder / "frames.pvd").write_text(f"<VTKFile type=\"Collection\"><Collection>{''.join(entries)}</Collection></VTKFile>")
    (folder / "history.csv").write_text(HISTORY)


class Picture(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name) / "scene-results"
        self.folder.mkdir()
        write_run(self.folder)

    def run_main(self, *arguments):
        """Exit status and what was said on stderr."""
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            status = picture.main([str(self.folder), *arguments])
        return status, said.getvalue()

    def test_frames_keep_places_and_values(self):
        frame = picture.read(*picture.series(self.folder)[2], "velocity")
        self.assertEqual(frame.time, 0.2)
        np.testing.assert_allclose(frame.values, [0.0, 5.0])
        np.testing.assert_allclose(frame.polygons[1][0], [1.6, -0.2])

    def test_a_component_is_picked_by_name(self):
        np.testing.assert_allclose(picture.read(*picture.series(self.folder)[0], "stress:yy").values, [0.0, 7.0])

    def test_snapshots_include_both_ends(self):
        frames = [(0.1 * i, i) for i in range(11)]
        self.assertEqual([i for _, i in picture.choose(frames, 3, None)], [0, 5, 10])
        self.assertEqual([i for _, i in picture.choose(frames, 3, [0.22, 0.98])], [2, 10])

    def test_pictures_are_drawn(self):
        beside = self.folder.parent
        before = sorted(self.folder.iterdir())
        status, _ = self.run_main("--field", "stress:xx", "--energies", str(beside / "energies.png"))
        self.assertEqual(status, 0)
        for name in ("scene-results.png", "energies.png"):
            pixels = image.imread(beside / name)
            self.assertGreater(len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)), 10, name)
        self.assertEqual(sorted(self.folder.iterdir()), before, "the folder is the run's")

    def test_in_space_the_eye_sees_what_faces_it_hindmost_first(self):
        ground = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0], [-9, -9, -1], [9, -9, -1], [9, 9, -1], [-9, 9, -1]]
        rock = [[-1, -1, 1], [2, 0, 1], [0, 2, 1], [0, 0, 3]]
        cells = [("hexahedron", np.array([[4, 5, 6, 7, 0, 1, 2, 3]])), ("tetra", np.array([[8, 9, 10, 11]]))]
        solid = meshio.Mesh(np.array(ground + rock, float), cells, cell_data={"block": [[0], [1]]})
        file = self.folder / "frames" / "solid.vtu"
        solid.write(file)
        from_above = picture.read(0.0, file, "block", (0.0, 90.0))
        # From above with x downwards on the page: the ground's top, then three faces.
        self.assertTrue(np.all(np.diff(from_above.values) >= 0), "the rock hides the ground")
        corners = np.concatenate([p for p, value in zip(from_above.polygons, from_above.values) if value == 0])
        np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[-9, -9], [9, 9]], atol=1e-12)
        from_below = picture.read(0.0, file, "block", (0.0, -90.0))
        self.assertTrue(np.all(np.diff(from_below.values) <= 0), "the base hides the rock")
        self.assertTrue(np.all((picture.DARK <= from_above.brightness) & (from_above.brightness <= picture.BRIGHT)))

    def test_a_wall_hides_what_is_behind_it_wherever_it_reaches(self):
        wall = np.array([[0.0, 0, 0], [0, 4, 0], [0, 4, 2], [0, 0, 2]])
        behind = np.array([[-0.1, 0.2, 0.2], [-0.1, 0.5, 0.2], [-0.1, 0.5, 0.5], [-0.1, 0.2, 0.5]])
        parts, blocks, *_ = picture.see([wall, behind], np.array([0, 1]), (-20.0, 10.0))
        for hidden in np.flatnonzero(blocks == 1):
            middle = parts[hidden].mean(axis=0)
            over = [np.all((part.min(axis=0) <= middle) & (middle <= part.max(axis=0))) for part in parts]
            later = [k > hidden for k in np.flatnonzero(over) if blocks[k] == 0 and len(parts[k]) > 2]
            self.assertTrue(later and all(later), "the wall is drawn later")

    def test_names_have_distinct_colours_and_numbers_a_scale(self):
        colour_map, least, most = picture.colours(np.array([0, 2, 1]), named=True)
        self.assertEqual((colour_map.N, least, most), (3, -0.5, 2.5))
        self.assertEqual(len({tuple(colour) for colour in colour_map.colors}), 3)
        self.assertEqual(picture.colours(np.array([-1.0, 4.0]), named=False)[1:], (-4.0, 4.0))

    def test_long_models_are_drawn_above_each_other(self):
        self.assertEqual(picture.layout(1.0, 0.6, 4)[:2], (1, 4))
        rows, columns, (across, down) = picture.layout(4.0, 1.2, 4)
        self.assertEqual((rows, columns), (2, 2))
        self.assertAlmostEqual(across / down, 4.0 / 1.2)
        self.assertGreaterEqual(down, picture.PANEL_HEIGHT)
        self.assertEqual(picture.layout(40.0, 1.0, 5)[:2], (5, 1))

    def test_pictures_of_examples_are_made_as_their_readmes_say(self):
        for example in ("two-prisms-2d", "rockfall-3d"):
            command = Image.open(EXAMPLES / example / "picture.png").text["Description"]
            readme = " ".join((EXAMPLES / example / "README.md").read_text().replace("\\\n", " ").split())
            self.assertIn(command, readme)

    def test_an_unknown_field_is_answered_with_the_known_ones(self):
        status, said = self.run_main("--field", "speed")
        self.assertEqual(status, 2)
        self.assertIn("level, stress, velocity", said)

    def test_a_folder_without_frames_is_named(self):
        (self.folder / "frames.pvd").unlink()
        status, said = self.run_main()
        self.assertEqual(status, 2)
        self.assertIn("frames.pvd does not exist", said)


if __name__ == "__main__":
    unittest.main()
