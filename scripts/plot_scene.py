#!/usr/bin/python3
"""Draw scenes to scale: the beam with its masses, its stops and supports, the start; with --film also the beam as it moves.

Plots what the results files hold and computes nothing; between nodes the beam is the cubic of its elements. The file of a
single run contains the shape at the start; the film needs further shapes: &output shape_step.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import matplotlib.axis as axis
import matplotlib.colors as colors
import matplotlib.patches as patches
import matplotlib.pyplot as plt
import matplotlib.spines as spines
import matplotlib.ticker as ticker
import matplotlib.transforms as transforms
import numpy
from PIL import Image


BEAM = "#c3d3e8"
BODY = "#efe3c8"
EDGE = "#1f5fa8"
GROUND = "#666666"
TOUCHED = "#e08a5b"
LAWS = {"restitution": "rigid", "three_element": "three elements", "spring_damper": "spring and damper"}
# Points of an element
POINTS = 13
FRAME_TAU = 0.04
MOST_FRAMES = 200
FRAMES_A_SECOND = 20


def cubics(node, x, value, slope):
    """The cubics between the nodes at x, [instant, x], from values and slopes, [instant, node]."""
    element = numpy.clip(numpy.searchsorted(node, x, side="right") - 1, 0, len(node) - 2)
    length = node[element + 1] - node[element]
    s = (x - node[element]) / length
    return (value[:, element] * (1 + 2 * s) * (1 - s)**2 + slope[:, element] * length * s * (1 - s)**2
            + value[:, element + 1] * s**2 * (3 - 2 * s) - slope[:, element + 1] * length * s**2 * (1 - s))


def within_elements(node):
    """Points along the beam, of each element from end to end; a node between two elements comes twice."""
    return numpy.concatenate([numpy.linspace(a, b, POINTS) for a, b in zip(node[:-1], node[1:])])


def plain(group, name):
    """The numbers of a dataset without units."""
    return plots.values_of(group, name, "dimensionless")


class Surface:
    """One side of a stop: its number, +1 below and -1 above, place, height, law, contacts, gap over time."""

    def __init__(self, stop, side, position, height, law):
        self.stop, self.side, self.position, self.height, self.law = int(stop), int(side), position, height, law
        self.contacts = []
        self.eta = None


class Body:
    """A body: its number, place and law, its faces towards the beam (side, height at z = 0), its floor and ceiling (side, z), z over time."""

    def __init__(self, number, position, law, has_spring, z):
        self.number, self.position, self.law, self.has_spring, self.z = number, position, law, has_spring, z
        self.faces, self.bases, self.contacts = [], [], []

    def start(self):
        """z at the start, as far as it is known."""
        return 0.0 if self.z is None else self.z[0]


class Scene:
    """The scene of a file, lengths along the beam in L, displacements in the units of the scene if known."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            if "cases" in file or "sweep" in file:
                raise plots.missing(file, "holds several cases, no single scene")
            scene = plots.group_of(file, "scene", "scene")
            if "mesh" not in file:
                raise plots.missing(file, "holds no run of the scene, which its picture needs: see &response")
            if "stop" not in scene and "bodies" not in file:
                raise plots.missing(file, "its scene has no &stop and no &body")
            self.name, self.title = path.stem, plots.title_of(file)
            scales = scene["scales"].attrs
            self.unit = float(scales["displacement"])
            self.is_known = self.unit > 0.0
            self.unit = self.unit if self.is_known else 1.0
            self.length = float(scales["length"])
            # times stay without units, and are shown in them
            self.factor, self.unit_text, self.time_factor, self.time_text = 1.0, "", 1.0, ""
            self.time_scale, self.time_unit = 1.0, ""
            self.along = plots.Along(file, plots.unit_of(file["mesh"], "x"))
            if "units" in file.attrs and self.is_known:
                self.take_units(file, 1.0 / float(scales["omega1"]))
            self.read_surfaces(file)
            self.supports = [dict(scene[name].attrs) for name in scene if name.startswith("support")]
            self.read_root(scene)
            self.read_masses(scene)
            self.read_section(file)
            self.read_shapes(file)
            self.read_start(scene)

    def take_units(self, file, time):
        """Displacements and times as they are read."""
        heights = abs(file["surfaces/height"][()]) if "surfaces" in file else numpy.zeros(1)
        self.factor, self.unit_text = plots.reading(max(self.unit, heights.max()), plots.unit_of(file["mesh"], "x"))
        self.time_scale, self.time_unit = time, "s" if self.unit_text != plots.OF_SCENE else plots.OF_SCENE
        factor, self.time_text = plots.reading(20.0 * time, "s" if self.unit_text != plots.OF_SCENE else plots.OF_SCENE)
        self.time_factor = time * factor
        self.unit *= self.factor
        self.length *= self.factor

    def time_label(self):
        """Of an axis."""
        return plots.with_unit("$t$", self.time_text) if self.time_text else r"$\tau$"

    def window(self, start, end):
        """Leave only the shapes and histories from a time to another, both as the command line has them."""
        low = -numpy.inf if start is None else plots.time_of(start, self.time_unit) / self.time_scale
        high = numpy.inf if end is None else plots.time_of(end, self.time_unit) / self.time_scale
        inside = (self.shape_tau >= low - 1e-9) & (self.shape_tau <= high + 1e-9)
        self.shape_tau, self.shape = self.shape_tau[inside], self.shape[inside]

    def label_length(self, axes):
        """Ticks and label along the beam."""
        length = self.along.length
        ticks = ticker.MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, length)
        ticks = ticks[(ticks >= 0.0) & (ticks <= 1.001 * length)]
        axes.set_xticks(ticks / length, [f"{value:g}" for value in ticks])
        axes.xaxis.set_minor_locator(ticker.AutoMinorLocator())
        axes.set_xlabel(self.along.label())

    def displacement_label(self, words="displacement $y$"):
        """Of an axis."""
        return plots.with_unit(words, self.unit_text) + ("" if self.is_known else " over $D$")

    def read_surfaces(self, file):
        """Sides of stops; the file of the paper's one stop has no list of them."""
        scene = file["scene"]
        self.bodies = []
        laws = {name: plots.text_of(scene[name].attrs["law"]) for name in scene if name.split("_")[0] == "stop"}
        recorded = file["response"] if "response" in file else {}
        self.tau = plain(recorded, "tau") if plots.has(recorded, "tau") else None
        if "surfaces" not in file:
            stop = scene["stop"].attrs
            self.surfaces = [Surface(1, 1, float(stop["position"]), self.unit * float(stop["preload"]), laws["stop"])]
            groups = [(self.surfaces[0], file["measures"])] if "measures" in file else []
            for surface, group in groups:
                surface.contacts = list(zip(plain(group, "contact_start"), plain(group, "contact_end")))
            if plots.has(recorded, "eta_stop"):
                self.surfaces[0].eta = self.unit * plain(recorded, "eta_stop")
            return
        group = file["surfaces"]
        rows = list(zip(group["stop"][()], group["side"][()], plain(group, "position"), self.unit * plain(group, "height")))
        self.surfaces = [Surface(*row, laws["stop" if row[0] == 1 else f"stop_{row[0]}"]) for row in rows if row[0] > 0]
        numbers = [number for number, row in enumerate(rows) if row[0] > 0]
        for number, surface in zip(numbers, self.surfaces):
            if plots.has(group, "eta"):
                surface.eta = self.unit * plain(group, "eta")[number]
            surface.contacts = self.contacts_of(group, number)
        if "bodies" in file:
            self.read_bodies(file, rows)

    @staticmethod
    def contacts_of(group, number):
        """Begin and end of each contact with a surface."""
        if "contact" not in group:
            return []
        own = group["contact_surface"][()] == number + 1
        return list(zip(plain(group, "contact_start")[own], plain(group, "contact_end")[own]))

    def read_bodies(self, file, rows):
        """The bodies with their faces, and how they move; where nothing was recorded they stay at z = 0."""
        surfaces, group = file["surfaces"], file["bodies"]
        names = plots.text_of(surfaces["surface"].attrs["flag_meanings"]).split()
        moved = self.unit * plain(group, "displacement") if plots.has(group, "displacement") else None
        if moved is not None:
            self.tau = plain(group, "tau")
        for number in group["body"][()]:
            settings = file["scene"][f"body_{number}"].attrs
            self.bodies.append(Body(int(number), float(settings["position"]), plots.text_of(settings["law"]),
                                    "spring_ratio" in settings, None if moved is None else moved[number - 1]))
        for place, (name, number, (_, side, _, height)) in enumerate(zip(names, surfaces["body"][()], rows)):
            if number == 0:
                continue
            body = self.bodies[number - 1]
            (body.bases if name.endswith(("floor", "ceiling")) else body.faces).append((int(side), float(height)))
            if not name.endswith(("floor", "ceiling")):
                body.contacts += self.contacts_of(surfaces, place)

    def read_section(self, file):
        """Heights of the beam at `x`, linear within elements; of area and inertia, those of the rectangle with the same."""
        group, scene = file["mesh"], file["scene"]
        if "height_root_side" not in group:
            raise plots.Unplottable(f"{file.filename}: has no heights of the beam: run the scene again")
        node = plain(group, "x")
        self.x = within_elements(node)
        ends = zip(group["height_root_side"][()], group["height_tip_side"][()])
        mean = self.length * float(scene["scales"].attrs["height_ratio"])
        self.height = mean * numpy.concatenate([numpy.linspace(*pair, POINTS) for pair in ends])
        self.is_rectangle = "area" not in scene["beam"].attrs and not (
            "section" in scene and plots.text_of(scene["section"].attrs["shape"]) == "general")

    def read_masses(self, scene):
        """Masses on the beam as position, ratio to the mass of the beam, whether it has rotary inertia."""
        attributes = [scene[name].attrs for name in scene if name.startswith("mass")]
        self.masses = [(float(mass["position"]), float(mass["mass_ratio"]), float(mass.get("rotary_inertia_ratio", 0.0)) > 0.0)
                       for mass in attributes]
        tip = float(scene["tip_mass"].attrs["ratio"]) if "tip_mass" in scene else 0.0
        self.masses += [(1.0, tip, False)] if tip > 0.0 else []

    def read_root(self, scene):
        """Support of the root, and the springs in place of a rigid clamp, by the motion that they resist."""
        root = scene["root"].attrs if "root" in scene else {}
        self.root = plots.text_of(root["kind"]) if "kind" in root else "clamped"
        self.root_springs = {motion: float(root[f"{name}_stiffness_ratio"])
                             for motion, name in (("displacement", "translation"), ("rotation", "rotation"))
                             if f"{name}_stiffness_ratio" in root}

    def read_shapes(self, file):
        """Displacement of the beam along x at some instants, from where it is unstressed."""
        self.shape_tau = numpy.array([])
        if "shapes" not in file:
            return
        group = file["shapes"]
        node = plain(group, "x")
        self.shape_tau = plain(group, "tau")
        value = plain(group, "displacement") + plots.height_of_release(file, "dimensionless")
        self.shape = self.unit * cubics(node, self.x, value, plain(group, "slope"))

    def read_start(self, scene):
        """How the motion starts; if the beam is released, position and displacement of that point."""
        kind = plots.text_of(scene["start"].attrs["kind"]) if "start" in scene else "pull"
        self.start_label = {"velocity": "start, moving", "drop": "start, falling"}.get(kind, "start")
        self.release = None
        if kind == "pull":
            stops, release = plots.stops_of(scene)
        if kind == "pull" and release is not None:
            position, side, preload = stops[release]
            self.release = position, (-1.0 if side == "above" else 1.0) * (1.0 + preload) * self.unit

    def start(self):
        """The shape at the start, if it was recorded."""
        return self.shape[0] if len(self.shape_tau) > 0 and self.shape_tau[0] <= 0.0 else None


def spring(axes, x, low, high, width):
    """A zigzag from low to high."""
    y = low + (high - low) * numpy.array([0.0, 0.18] + [0.18 + 0.64 * (k + 0.5) / 6 for k in range(6)] + [0.82, 1.0])
    side = numpy.array([0.0, 0.0] + [(-1)**k for k in range(6)] + [0.0, 0.0])
    return axes.plot(x + width * side, y, color="black", linewidth=0.8, solid_joinstyle="miter", zorder=6)


def damper(axes, x, low, high, width):
    """A dashpot from low to high."""
    cup, piston = low + 0.3 * (high - low), low + 0.5 * (high - low)
    brim = low + 0.68 * (high - low)
    for line in (([x, x], [low, cup]), ([x - width, x - width, x + width, x + width], [brim, cup, cup, brim]),
                 ([x, x], [piston, high]), ([x - 0.7 * width, x + 0.7 * width], [piston, piston])):
        axes.plot(*line, color="black", linewidth=0.8, zorder=6)


class Drawing:
    """The scene in one panel; `room` is the height of a stop's symbol."""

    def __init__(self, axes, scene, shapes):
        self.axes, self.scene = axes, scene
        heights = [surface.height for surface in scene.surfaces]
        heights += [height + body.start() for body in scene.bodies for _, height in body.faces]
        heights += [height + distance for body in scene.bodies for _, height in body.faces for _, distance in body.bases]
        # a film shows bodies as long as they are near
        if len(shapes) and len(shapes[0].shape) > 1:
            reach = 1.5 * max(numpy.abs(shapes[0]).max(), *[abs(height) for height in heights], 1e-30)
            heights += [numpy.clip(face + z, -reach, reach) for body in scene.bodies if body.z is not None
                        for _, face in body.faces for z in (body.z.min(), body.z.max())]
        released = [] if scene.release is None else [scene.release[1]]
        values = numpy.concatenate([heights, released, [0.0]] + [numpy.ravel(shape) for shape in shapes])
        span = values.max() - values.min()
        # a beam that begins to move from its stop gives no height
        if span < 1e-9 * scene.unit:
            span = scene.unit
        thickest = scene.height.max()
        self.factor = 1.0
        if not scene.is_known or not 0.04 * span <= thickest <= 0.6 * span:
            self.factor = 0.1 * span / thickest
        self.half = 0.5 * self.factor * scene.height
        self.room = 0.2 * span
        self.plates = [self.stop(surface) for surface in scene.surfaces]
        for support in scene.supports:
            self.support(support)
        self.bodies = [(body, *self.body(body)) for body in scene.bodies]
        margin = self.factor * thickest * 0.5 + self.room * 2.0
        axes.set_ylim(values.min() - margin, values.max() + margin)
        low, high = axes.get_ylim()
        for position, _, _ in scene.masses:
            axes.plot([position], [0.0], marker="o", markersize=7, color="black", linestyle="none", zorder=5, clip_on=False)
        if scene.root == "pinned" or scene.root_springs:
            # without a spring the displacement of an elastic root is held
            self.support({"position": 0.0, "motion": "displacement", **{
                "stiffness_ratio": ratio for motion, ratio in scene.root_springs.items() if motion == "displacement"}})
            if scene.root != "pinned":
                self.support({"position": 0.0, "motion": "rotation", **{
                    "stiffness_ratio": ratio for motion, ratio in scene.root_springs.items() if motion == "rotation"}})
        else:
            axes.add_patch(patches.Rectangle((-0.05, low), 0.05, high - low, facecolor="#e0e0e0", hatch="////",
                                             edgecolor=GROUND, linewidth=0.0))
            axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_xlim(-0.05, 1.08)
        scene.label_length(axes)
        axes.set_ylabel(scene.displacement_label())

    def half_at(self, position):
        """Half the height of the beam as it is drawn."""
        return float(numpy.interp(position, self.scene.x, self.half))

    def beam(self, shape, **options):
        """The beam with its heights about a line."""
        return self.axes.fill_between(self.scene.x, shape - self.half, shape + self.half, **options)

    def outline(self, shape):
        """What `beam` fills."""
        return numpy.column_stack([numpy.concatenate([self.scene.x, self.scene.x[::-1]]),
                                   numpy.concatenate([shape - self.half, (shape + self.half)[::-1]])])

    def ground(self, x, y, width, side):
        """A hatched line that nothing moves; it is below its edge where side is 1."""
        depth = -side * 0.12 * self.room
        self.axes.add_patch(patches.Rectangle((x - width, min(y, y + depth)), 2.0 * width, abs(depth), facecolor="white",
                                              hatch="//////", edgecolor=GROUND, linewidth=0.0))
        self.axes.plot([x - width, x + width], [y, y], color="black", linewidth=0.8)

    def stop(self, surface):
        """A plate at the surface, and what is behind it."""
        same = [other for other in self.scene.surfaces
                if other.side == surface.side and abs(other.position - surface.position) < 0.05]
        x = surface.position + 0.06 * same.index(surface) if len(same) > 1 else surface.position
        face = surface.height - surface.side * self.half_at(surface.position)
        end = face - surface.side * self.room
        width = 0.024
        if surface.law == "restitution":
            plate = patches.Rectangle((x - width, min(face, end)), 2 * width, abs(end - face), facecolor="#bbbbbb",
                                      edgecolor="black", linewidth=0.8)
        else:
            depth = -surface.side * 0.1 * self.room
            plate = patches.Rectangle((x - width, min(face, face + depth)), 2 * width, abs(depth), facecolor="#bbbbbb",
                                      edgecolor="black", linewidth=0.8)
            low = face + depth
            spring(self.axes, x - 0.5 * width, low, end, 0.3 * width)
            if surface.law == "three_element":
                middle = low + 0.5 * (end - low)
                spring(self.axes, x + 0.5 * width, low, middle, 0.3 * width)
                damper(self.axes, x + 0.5 * width, end, middle, 0.3 * width)
            else:
                damper(self.axes, x + 0.5 * width, end, low, 0.3 * width)
        plate.set_zorder(6)
        self.axes.add_patch(plate)
        self.ground(x, end, 1.3 * width, surface.side)
        self.axes.text(x, end - surface.side * 0.2 * self.room, str(surface.stop), ha="center", fontsize=9,
                       va="top" if surface.side > 0 else "bottom")
        return plate

    def body(self, body):
        """A body as a block with round corners, where it is at the start, its spring, floor and ceiling. One in a cavity is drawn as
        what is the same to the beam: two blocks of one body. Returns what moves with it, and its spring with the fixed end."""
        x, half, height, start = body.position, self.half_at(body.position), 0.7 * self.room, body.start()
        artists, ends, stretched = [], [], None
        for side, face in body.faces:
            low = face + start - side * half - (height if side > 0 else 0.0)
            ends.append((low, low + height))
            artists.append(self.axes.add_patch(patches.FancyBboxPatch(
                (x - 0.02, low), 0.04, height, facecolor=BODY, boxstyle="round,pad=0,rounding_size=0.012",
                mutation_aspect=self.room / 0.06, edgecolor="black", linewidth=0.8, zorder=6)))
        low, high = min(end[0] for end in ends), max(end[1] for end in ends)
        if len(ends) > 1:
            joint = x + 0.03
            artists += self.axes.plot([x, joint, joint, x], [low + 0.5 * height] * 2 + [high - 0.5 * height] * 2, color="black",
                                      linewidth=2.0, zorder=5)
        side = body.faces[0][0]
        for base, distance in body.bases:
            # the distance that the body has left to it, from the end that meets it
            self.ground(x + 0.014, (low if base > 0 else high) - start + distance, 0.018, base)
        if body.has_spring:
            # long enough for the way towards its fixed end
            way = 0.6 * self.room + (0.0 if body.z is None else min(max(side * (start - body.z)), 3.0 * self.room))
            end = low - way if side > 0 else high + way
            stretched = spring(self.axes, x - 0.012, *((end, low) if side > 0 else (high, end)), 0.006)[0], end
            self.ground(x - 0.016, end, 0.01, side)
        artists.append(self.axes.text(x - 0.03, 0.5 * sum(ends[-1]), f"body {body.number}", ha="right", va="center", fontsize=8, zorder=7))
        return artists, stretched

    def support(self, support):
        """A triangle or a spring below the beam, a square or an arc about its rotation."""
        x, motion = float(support["position"]), plots.text_of(support["motion"])
        below = -self.half_at(x)
        if motion == "rotation":
            is_rigid = "stiffness_ratio" not in support
            self.axes.plot([x], [0.0], marker="s" if is_rigid else "$\\circlearrowleft$", markersize=8 if is_rigid else 12,
                           color="black", zorder=5)
            return
        end = below - 0.8 * self.room
        if "stiffness_ratio" in support:
            spring(self.axes, x, end, below, 0.012)
        else:
            self.axes.add_patch(patches.Polygon([(x, below), (x - 0.02, end), (x + 0.02, end)], facecolor="white",
                                                edgecolor="black", linewidth=0.8, zorder=6))
        self.ground(x, end, 0.032, 1)


def list_of(scene):
    """A line for each spring of the root, stop, body, support and mass."""
    lines = [f"root: {motion}, spring, ratio {plots.round_number(ratio)}" for motion, ratio in scene.root_springs.items()]
    for stop in sorted({surface.stop for surface in scene.surfaces}):
        sides = [surface for surface in scene.surfaces if surface.stop == stop]
        places = " and ".join(f"{'below' if side.side > 0 else 'above'} the beam at $y$ = "
                              f"{plots.quantity(side.height, scene.unit_text)}" for side in sides)
        lines.append(f"stop {stop}: {scene.along.place(sides[0].position)}, {places}; {LAWS[sides[0].law]}")
    for body in scene.bodies:
        places = " and ".join(f"{'below' if side > 0 else 'above'} the beam at $y$ = "
                              f"{plots.quantity(height + body.start(), scene.unit_text)}" for side, height in body.faces)
        bases = "".join(f", {'floor' if side > 0 else 'ceiling'} {plots.quantity(abs(height), scene.unit_text)} "
                        f"{'below' if side > 0 else 'above'} $z$ = 0" for side, height in body.bases)
        lines.append(f"body {body.number}: {scene.along.place(body.position)}, {places}; contact: {LAWS[body.law]}{bases}")
    for support in scene.supports:
        kind = f"spring, ratio {plots.round_number(float(support['stiffness_ratio']))}" if "stiffness_ratio" in support else "rigid"
        lines.append(f"support: {scene.along.place(float(support['position']))}, {plots.text_of(support['motion'])}, {kind}")
    for position, ratio, has_inertia in scene.masses:
        lines.append(f"mass: {scene.along.place(position)}, {plots.round_number(ratio)} times that of the beam"
                     + (", with rotary inertia" if has_inertia else ""))
    return lines


def scales_of(drawing, figure):
    """What is drawn how large."""
    scene, axes = drawing.scene, drawing.axes
    if not scene.is_known:
        return ["The scene gives ratios only: the height of the beam is not to scale."]
    box = axes.get_position()
    across = box.width * figure.get_figwidth() / (1.13 * scene.length)
    up = box.height * figure.get_figheight() / numpy.ptp(axes.get_ylim())
    ratio = up / across
    height = "height" if scene.is_rectangle else r"height $\sqrt{12 I/A}$"
    return [f"Scale of displacements: {ratio:.3g} times that of lengths; {height} of the beam: {ratio * drawing.factor:.3g} times."]


def draw(scene):
    """The scene at rest without stress, and at the start."""
    start = scene.start()
    lines = list_of(scene)
    figure, axes = plt.subplots(figsize=(plots.WIDTH, 3.4))
    drawing = Drawing(axes, scene, [] if start is None else [start])
    drawing.beam(numpy.zeros_like(scene.x), facecolor=BEAM, edgecolor=EDGE, linewidth=0.8, zorder=2, label="unstressed")
    axes.plot([0.0, 1.0], [0.0, 0.0], color=EDGE, linewidth=0.5, linestyle=(0, (8, 2, 2, 2)), zorder=3)
    if start is not None:
        drawing.beam(start, facecolor="none", edgecolor="black", linewidth=0.9, linestyle=(0, (4, 1.5)), zorder=4,
                     label=scene.start_label)
    elif scene.release is not None:
        axes.plot(*scene.release, marker="v", markersize=6, color="black", linestyle="none", zorder=5, label="released here")
    axes.set_title(scene.title, pad=19)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.008, 0.99), ncol=3, borderaxespad=0.0, borderpad=0.3)
    for row, line in enumerate(lines + scales_of(drawing, figure)):
        axes.annotate(line, (0.0, 0.0), xytext=(0.0, -38.0 - 12.5 * row), xycoords="axes fraction",
                      textcoords="offset points", fontsize=8.5, va="top", style="italic" if row >= len(lines) else "normal")
    return figure


def animate(scene, path):
    """The beam moving among its stops, as a GIF."""
    if len(scene.shape_tau) < 2:
        raise plots.Unplottable(f"{scene.name}: has the shape at the start only: see &output shape_step")
    frames = [0]
    for index, tau in enumerate(scene.shape_tau):
        if tau - scene.shape_tau[frames[-1]] >= FRAME_TAU - 1e-9:
            frames.append(index)
    frames = frames[::-(-len(frames) // MOST_FRAMES)]
    recorded = [surface for surface in scene.surfaces if surface.eta is not None]
    # the displacement at a stop that stands on both sides is one curve
    points = list({surface.position: surface for surface in recorded}.values())
    # six curves have room in a line of the legend between the panels
    lines = (len(points) + len(scene.bodies) - 1) // 6
    figure, (axes, below) = plt.subplots(2, 1, figsize=(5.6, 4.4), gridspec_kw={"height_ratios": [2.2, 1.0], "hspace": 0.36 + 0.14 * lines})
    figure.subplots_adjust(left=0.15, right=0.975, top=0.95, bottom=0.11)
    drawing = Drawing(axes, scene, [scene.shape])
    axes.plot([0.0, 1.0], [0.0, 0.0], color=EDGE, linewidth=0.5, linestyle=(0, (8, 2, 2, 2)), zorder=1)
    band = drawing.beam(scene.shape[0], facecolor=BEAM, edgecolor=EDGE, linewidth=0.8, zorder=4)
    clock = axes.text(0.07, 0.96, "", transform=axes.transAxes, ha="left", va="top")
    axes.minorticks_off()
    traces = []
    time = None if scene.tau is None else scene.time_factor * scene.tau
    for number_of_point, surface in enumerate(points):
        line = plots.line_of(number_of_point)
        y = surface.eta + surface.height
        below.plot(time, y, color=line["color"], linewidth=0.5, alpha=0.4)
        traces.append((below.plot([], [], **line, linewidth=1.1, label=scene.along.place(surface.position))[0], y))
    for surface in scene.surfaces:
        below.axhline(surface.height, color=GROUND, linewidth=0.5, linestyle=(0, (4, 3)))
    for body in scene.bodies if scene.tau is not None else []:
        colour = plots.COLOURS[(len(points) + body.number) % len(plots.COLOURS)]
        for number_of_face, (_, height) in enumerate(body.faces):
            y = numpy.where(abs(body.z + height) <= max(abs(limit) for limit in drawing.axes.get_ylim()), body.z + height, numpy.nan)
            below.plot(time, y, color=colour, linewidth=0.5, alpha=0.4)
            traces.append((below.plot([], [], color=colour, linewidth=1.1,
                                      label=f"body {body.number}" if number_of_face == 0 else None)[0], y))
    if scene.bodies and not points:
        y = numpy.array([numpy.interp(scene.bodies[0].position, scene.x, shape) for shape in scene.shape])
        y = y if scene.tau is None else numpy.interp(scene.tau, scene.shape_tau, y)
        below.plot(time, y, color=plots.COLOURS[0], linewidth=0.5, alpha=0.4)
        traces.append((below.plot([], [], color=plots.COLOURS[0], linewidth=1.1,
                                  label=f"beam, {scene.along.place(scene.bodies[0].position)}")[0], y))
    below.set(xlim=(scene.time_factor * scene.shape_tau[0], scene.time_factor * scene.shape_tau[-1]), xlabel=scene.time_label(),
              ylabel=plots.with_unit(["$y$", "$y$ at the stop", "$y$ at the stops"][min(len(points), 2)], scene.unit_text))
    if len(points) > 1 or scene.bodies:
        below.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1.0, 1.01), ncol=6, columnspacing=0.8,
                     handlelength=1.2, borderaxespad=0.0, borderpad=0.2)
    figure.align_ylabels((axes, below))

    lengths = {body.number: stretched[0].get_ydata() for body, _, stretched in drawing.bodies if stretched is not None}

    def show(frame):
        now = scene.shape_tau[frame]
        band.set_verts([drawing.outline(scene.shape[frame])])
        touched = set()
        for surface, plate in zip(scene.surfaces, drawing.plates):
            is_touched = any(start <= now <= end for start, end in surface.contacts)
            plate.set_facecolor(TOUCHED if is_touched else "#bbbbbb")
            touched |= {str(surface.stop)} if is_touched else set()
        for body, artists, stretched in drawing.bodies:
            moved = 0.0 if body.z is None else float(numpy.interp(now, scene.tau, body.z)) - body.start()
            for artist in artists:
                artist.set_transform(transforms.Affine2D().translate(0.0, moved) + drawing.axes.transData)
            if stretched is not None:
                line, end, rest = *stretched, lengths[body.number]
                line.set_ydata(end + (1.0 + moved / (rest[-1] - rest[0])) * (rest - end) if end == rest[0] else
                               end + (1.0 - moved / (rest[-1] - rest[0])) * (rest - end))
            is_touched = any(start <= now <= end for start, end in body.contacts)
            for artist in artists[:len(body.faces)]:
                artist.set_facecolor(TOUCHED if is_touched else BODY)
            touched |= {f"body {body.number}"} if is_touched else set()
        contact = "" if not touched else ", in contact" + (f" with {', '.join(sorted(touched))}" if len(scene.surfaces) + len(scene.bodies) > 1 else "")
        unit = "" if scene.time_text in ("", plots.OF_SCENE) else f" {scene.time_text}"
        clock.set_text((rf"$t$ = {scene.time_factor * now:.3g}{unit}" if scene.time_text else rf"$\tau$ = {now:.2f}") + contact)
        for trace, y in traces:
            trace.set_data(time[scene.tau <= now], y[scene.tau <= now])

    bodies = [artist for _, artists, stretched in drawing.bodies for artist in [*artists, *(stretched or [])[:1]]]
    with plots.complete_file(path) as partial:
        save_film(figure, [*drawing.plates, *bodies, band, clock, *(trace for trace, _ in traces)], show, frames, partial)
    plt.close(figure)


def save_film(figure, moving, show, frames, path):
    """A GIF: what rests is drawn once, and each frame gets on it what moves and what stands in front of that."""
    figure.set_dpi(100)
    layers = []
    for axes in figure.axes:
        mine = [artist for artist in moving if artist.axes is axes]
        lowest = min((artist.zorder for artist in mine), default=numpy.inf)
        # ticks and frames are in nobody's way
        layers.append([artist for artist in axes.get_children() if artist.zorder >= lowest and artist.get_visible()
                       and not isinstance(artist, (axis.Axis, spines.Spine)) and artist is not axes.patch])
    for artist in sum(layers, []):
        artist.set_visible(False)
    figure.canvas.draw()
    resting = figure.canvas.copy_from_bbox(figure.bbox)
    for artist in sum(layers, []):
        artist.set_visible(True)
    images = []
    for frame in frames:
        figure.canvas.restore_region(resting)
        show(frame)
        for artist in sorted(sum(layers, []), key=lambda artist: artist.zorder):
            artist.axes.draw_artist(artist)
        images.append(Image.fromarray(numpy.array(figure.canvas.buffer_rgba())).convert("RGB"))
    # one palette for all: what a few show, and what few show
    few = images[::max(1, len(images) // 8)]
    sample = Image.new("RGB", (few[0].width, few[0].height * len(few)))
    for place, image in enumerate(few):
        sample.paste(image, (0, place * image.height))
    exact = numpy.round(255.0 * colors.to_rgba_array(["white", TOUCHED, EDGE, BEAM, *plots.COLOURS])[:, :3])
    others = numpy.array(sample.quantize(64, dither=Image.Dither.NONE).getpalette()[:3 * 64]).reshape(-1, 3)
    # Pillow takes colours for the same that are closer
    others = others[abs(others[:, None] - exact).max(axis=2).min(axis=1) >= 16]
    palette = Image.new("P", (1, 1))
    palette.putpalette(numpy.concatenate([exact, others]).astype(int).flatten().tolist())
    images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // FRAMES_A_SECOND, loop=0)


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files")
    parser.add_argument("--film", action="store_true", help="an animation too, a .gif beside the picture")
    parser.add_argument("--from", dest="start", metavar="TIME", help="beginning of the film, such as 0.02 or, in files in units, 20ms")
    parser.add_argument("--to", dest="end", metavar="TIME", help="its end")
    parser.add_argument("--out", type=Path, metavar="PICTURE",
                        help="file of the picture, .png, .pdf or .svg (default: beside the results, NAME_scene.png); with --film also "
                        ".gif, the animation alone")
    arguments = parser.parse_args()
    if arguments.out and len(arguments.files) > 1:
        parser.error("--out names one picture: give one file")
    for path in arguments.files:
        scene = Scene(path)
        picture = arguments.out or path.with_name(f"{path.stem}_scene.png")
        if not arguments.film or picture.suffix != ".gif":
            plots.save(draw(scene), picture)
        if arguments.film:
            scene.window(arguments.start, arguments.end)
            animate(scene, picture.with_suffix(".gif"))


if __name__ == "__main__":
    plots.run(main)
