#!/usr/bin/python3
"""Plot responses: displacement at the stop and at the tip over time, contact shaded, impacts marked.

Plots what the results files hold and computes nothing.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import impactbeam_plots as plots
import matplotlib.patches as patches
import matplotlib.pyplot as plt
import matplotlib.ticker as ticker
import numpy


# Dataset, label without units, label in units
PANELS = {
    "displacement": ("eta_stop", r"displacement $\eta = (y - d)/D$", r"displacement $y - d$"),
    "velocity": ("velocity_stop", r"velocity $\mathrm{d}\eta/\mathrm{d}\tau$", r"velocity $\mathrm{d}y/\mathrm{d}t$"),
    "force": ("contact_force", r"contact force $\bar{P}$", r"contact force $P$"),
    "moment": ("moment", r"bending moment, in $\bar{P} L$", r"bending moment $M$"),
    "stress": ("stress", r"stress $\sigma$, in $E D/L$", r"stress $\sigma$"),
}
# Those of places along the beam
OF_PLACES = ("moment", "stress")
# Each history, and the panel that it belongs to
RECORDS = {"eta_stop": "displacement", "eta_tip": "displacement", "velocity_stop": "velocity", "contact_force": "force"}
OF_SURFACES = {"eta": "displacement", "velocity": "velocity", "force": "force"}
RECORDED_BY = {panel: "&stress" if panel in OF_PLACES else "&output histories" for panel in PANELS}
NOTHING_RECORDED = "no history that has a picture was recorded: see &output histories"
IMPACTS = ("impact", "contact")
# Of more than these neither contacts nor impacts are marked, as they would cover the panel.
MOST_CONTACTS = 300


class Surface(NamedTuple):
    """One side of a stop, +1 below the beam and -1 above it, or a contact of a body, whose stop is 0."""

    name: str
    stop: int
    position: float
    side: int
    height: float
    histories: dict
    contacts: list
    body: int = 0


class Body(NamedTuple):
    """A body that moves on its own: its number, place, and displacement, velocity and force."""

    number: int
    position: float
    histories: dict


class Response:
    """What a picture shows of one file."""

    def __init__(self, path, wanted):
        with plots.open_results(path) as file:
            if "cases" in file:
                raise plots.missing(file, "holds several cases")
            if "sweep" in file:
                raise plots.missing(file, "holds a sweep")
            if "response" not in file and "events" in file:
                raise plots.missing(file, NOTHING_RECORDED)
            group = plots.group_of(file, "response", "&response")
            self.path = path
            self.title = plots.title_of(file)
            self.wanted = wanted
            # without a stop, displacements count from the unstressed beam
            self.has_stop = "stop" in file["scene"]
            self.along = plots.Along(file, plots.unit_of(file["mesh"], "x", wanted))
            recorded = [name for name in RECORDS if plots.has(group, name)]
            of_places = [name for name in OF_PLACES if "stress" in file and plots.has(file["stress"], name)]
            if not recorded and not of_places:
                raise plots.missing(file, NOTHING_RECORDED)
            self.tau = self.values(group, "tau")
            self.curves = {name: self.values(group, name) for name in recorded}
            # the unit of each kind of quantity, as it is read
            self.units = {"time": plots.unit_of(group, "tau", wanted)}
            self.units.update({RECORDS[name]: plots.unit_of(group, name, wanted) for name in recorded})
            if of_places:
                self.places = plots.values_of(file["stress"], "position", "dimensionless")
            self.of_places = {name: self.values(file["stress"], name) for name in of_places}
            self.units.update({name: plots.unit_of(file["stress"], name, wanted) for name in of_places})
            self.surfaces = self.read_surfaces(file["surfaces"]) if "surfaces" in file else []
            self.bodies = self.read_bodies(file["bodies"]) if "bodies" in file else []
            self.shown = self.find_shown()
            self.impacts = self.read_impacts(file["events"]) if "events" in file else []
            self.contacts = self.read_contacts(file["measures"]) if "measures" in file else []
            if self.shown is not None:
                self.contacts = self.surfaces[self.shown].contacts

    def values(self, group, name):
        """The numbers of a dataset, in the units that were asked for."""
        return plots.values_of(group, name, self.wanted)

    def is_in_units(self):
        """Are its numbers in units?"""
        return self.units["time"] != ""

    def greatest(self, kind):
        """The maximum magnitude of a kind of quantity."""
        shown = [self.tau] if kind == "time" else [curve for name, curve in self.curves.items() if RECORDS[name] == kind]
        shown += [values for surface in self.surfaces + self.bodies for name, values in surface.histories.items()
                  if OF_SURFACES[name] == kind]
        shown += [values for name, values in self.of_places.items() if name == kind]
        return max((float(abs(values).max()) for values in shown if len(values)), default=0.0)

    def cut(self, start, end):
        """Leave only a window of time, in the units of the file."""
        unit = self.units["time"]
        start = self.tau[0] if start is None else plots.time_of(start, unit)
        end = self.tau[-1] if end is None else plots.time_of(end, unit)
        inside = (self.tau >= start) & (self.tau <= end)
        if inside.sum() < 2:
            raise plots.Unplottable(f"{self.path}: has no two samples from {start:g} to {end:g}, only from {self.tau[0]:g} to "
                                    f"{self.tau[-1]:g}")
        self.tau = self.tau[inside]
        self.curves = {name: curve[inside] for name, curve in self.curves.items()}
        self.of_places = {name: values[:, inside] for name, values in self.of_places.items()}
        self.impacts = [(tau, eta) for tau, eta in self.impacts if start <= tau <= end]
        self.contacts = clipped(self.contacts, start, end)
        self.surfaces = [surface._replace(contacts=clipped(surface.contacts, start, end),
                                          histories={name: values[inside] for name, values in surface.histories.items()})
                         for surface in self.surfaces]
        self.bodies = [body._replace(histories={name: values[inside] for name, values in body.histories.items()})
                       for body in self.bodies]

    def multiply(self, factors, units):
        """Take other units."""
        time, length = factors.get("time", 1.0), factors.get("displacement", 1.0)
        self.units.update(units)
        self.tau = self.tau * time
        self.curves = {name: curve * factors.get(RECORDS[name], 1.0) for name, curve in self.curves.items()}
        self.of_places = {name: values * factors.get(name, 1.0) for name, values in self.of_places.items()}
        self.impacts = [(tau * time, eta * length) for tau, eta in self.impacts]
        self.contacts = [(start * time, end * time) for start, end in self.contacts]
        self.surfaces = [surface._replace(
            height=surface.height * length, contacts=[(start * time, end * time) for start, end in surface.contacts],
            histories={name: values * factors.get(OF_SURFACES[name], 1.0) for name, values in surface.histories.items()})
            for surface in self.surfaces]
        self.bodies = [body._replace(histories={name: values * factors.get(OF_SURFACES[name], 1.0)
                                                for name, values in body.histories.items()}) for body in self.bodies]

    def read_impacts(self, events):
        """Time and displacement of the impacts; of several stops those at the one shown."""
        names = plots.text_of(events["kind"].attrs["flag_meanings"]).split()
        kinds = [names[kind - 1] in IMPACTS for kind in events["kind"]]
        if self.shown is not None:
            kinds = [is_impact and surface == self.shown + 1 for is_impact, surface in zip(kinds, events["surface"])]
        rows = zip(kinds, self.values(events, "tau"), self.values(events, "eta"), events["velocity_before"])
        # a contact that is closed at rest at the start is no impact
        return [(tau, eta) for is_impact, tau, eta, velocity in rows if is_impact and (tau > 0 or velocity != 0)]

    def read_contacts(self, measures):
        """Begin and end of each contact."""
        return list(zip(self.values(measures, "contact_start"), self.values(measures, "contact_end")))

    def read_surfaces(self, group):
        """What happens at each side of several stops."""
        numbers, heights = group["stop"][()], self.values(group, "height")
        names = plots.text_of(group["surface"].attrs["flag_meanings"]).replace("stop_", "").split()
        places, sides = plots.values_of(group, "position", "dimensionless"), group["side"][()]
        bodies = group["body"][()] if "body" in group else 0 * numbers
        histories = {name: self.values(group, name) for name in OF_SURFACES if plots.has(group, name)}
        contacts = list(zip(group["contact_surface"][()], self.values(group, "contact_start"), self.values(group, "contact_end")))
        return [Surface(names[row].replace("_", " "), int(numbers[row]), float(places[row]), int(sides[row]), float(heights[row]),
                        {name: values[row] for name, values in histories.items()},
                        [(start, end) for surface, start, end in contacts if surface == row + 1], int(bodies[row]))
                for row in range(len(numbers))]

    def read_bodies(self, group):
        """How each body moves."""
        places = plots.values_of(group, "position", "dimensionless")
        histories = {name: self.values(group, other) for name, other in
                     (("eta", "displacement"), ("velocity", "velocity"), ("force", "force")) if plots.has(group, other)}
        return [Body(row + 1, float(place), {name: values[row] for name, values in histories.items()})
                for row, place in enumerate(places)]

    def has(self, panel):
        """Was something recorded for this panel?"""
        return PANELS[panel][0] in self.curves or panel in self.of_places or (panel == "displacement" and "eta_tip" in self.curves)

    def tip_differs(self):
        """Is the tip another point than the stop?"""
        if "eta_tip" not in self.curves or "eta_stop" not in self.curves:
            return "eta_tip" in self.curves
        differences = abs(self.curves["eta_tip"] - self.curves["eta_stop"])
        return bool((differences > 1e-9 * self.greatest("displacement")).any())

    def find_shown(self):
        """Of several surfaces the place of the one whose displacement is that of the run."""
        for place, surface in enumerate(self.surfaces):
            if "eta" in surface.histories and (surface.histories["eta"] == self.curves.get("eta_stop")).all():
                return place
        return None

    def shown_stop(self):
        """The same in words."""
        stops = len({surface.stop for surface in self.surfaces})
        if stops < 2 or self.shown is None:
            return ""
        return f"at stop {self.surfaces[self.shown].stop} of {stops}, {self.along.place(self.surfaces[self.shown].position)}"


def read_alike(responses):
    """Give responses that share axes the same units, chosen by their maximum values."""
    if len({response.is_in_units() for response in responses}) > 1:
        raise plots.Unplottable("some files are in units and some are not: --units dimensionless draws them alike")
    factors, units = {}, {}
    for kind in dict.fromkeys(kind for response in responses for kind in response.units):
        own = {response.units[kind] for response in responses if kind in response.units}
        if len(own) > 1:
            raise plots.Unplottable(f"the files differ in units ({', '.join(sorted(own))}): --units dimensionless draws them alike")
        greatest = max(response.greatest(kind) for response in responses)
        factors[kind], units[kind] = plots.reading(greatest, own.pop())
    for response in responses:
        response.multiply(factors, units)


def clipped(contacts, start, end):
    """The parts of contacts in a window of time."""
    return [(max(first, start), min(last, end)) for first, last in contacts if first < end and last > start]


def shade_contacts(axes, response):
    """Grey where the beam touches the stop."""
    for start, end in response.contacts if len(response.contacts) <= MOST_CONTACTS else []:
        axes.axvspan(start, end, facecolor=plots.CONTACT, edgecolor=plots.CONTACT, linewidth=0.4, zorder=0.5)


def mark_impacts(axes, response):
    """A small wedge under the curve at each impact."""
    if 0 < len(response.impacts) <= MOST_CONTACTS:
        tau, eta = zip(*response.impacts)
        axes.plot(tau, eta, linestyle="none", marker=6, markersize=4.5, color="black", zorder=4)


def legend_of_signs(response):
    """Handles for what is shaded and marked."""
    handles = []
    if 0 < len(response.impacts) <= MOST_CONTACTS:
        handles.append(plt.Line2D([], [], linestyle="none", marker=6, markersize=4.5, color="black", label="impact"))
    if 0 < len(response.contacts) <= MOST_CONTACTS:
        handles.append(patches.Patch(facecolor=plots.CONTACT, label="contact"))
    return handles


def put_legend_above(axes, handles, bottom=0.99):
    """A legend in one row above the panel; `bottom` is its lower side in heights of the panel, above a title if need be."""
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(-0.008, bottom), ncol=len(handles),
                columnspacing=1.6, handletextpad=0.6, borderaxespad=0.0, borderpad=0.3)


def put_small_legend_above(axes, handles=None):
    """The legend of a lower panel, in a row above its frame at the right; by default of all labelled curves."""
    axes.legend(handles=handles, fontsize=7.5, loc="lower right", bbox_to_anchor=(1.0, 1.01), ncol=6, columnspacing=1.0,
                handlelength=2.0, borderaxespad=0.0, borderpad=0.2)


def draw_tip(axes, response):
    """Displacement of the tip."""
    return plots.draw_history(axes, response.tau, response.curves["eta_tip"], "tip", color=plots.COLOURS[1], linestyle=plots.DASHES[1],
                              linewidth=0.9)


def draw_displacement(axes, response):
    """Displacement at the stop and, where it differs, at the tip."""
    handles = []
    if "eta_tip" in response.curves and response.tip_differs():
        handles += draw_tip(axes, response)
    if "eta_stop" in response.curves:
        at = "body" if response.shown is not None and response.surfaces[response.shown].stop == 0 else "stop"
        label = at if response.tip_differs() else f"{at} = tip" if response.has_stop or at == "body" else "tip"
        handles = plots.draw_history(axes, response.tau, response.curves["eta_stop"], label, color="black") + handles
    mark_impacts(axes, response)
    return handles


def set_ticks(axis, count):
    """About `count` intervals between ticks, of lengths that read easily."""
    axis.set_major_locator(ticker.MaxNLocator(count, steps=[1, 2, 5, 10]))


def label_panel(axes, panel, response, words=None):
    """Axis label, line of rest, ticks."""
    words = words or PANELS[panel][2 if response.is_in_units() else 1]
    words = words if response.has_stop else words.replace("(y - d)", "y").replace("y - d", "y")
    words = plots.with_unit(words, response.units.get(panel, ""))
    axes.set_ylabel(words if panel == "displacement" else words.replace(" $", "\n$", 1).replace(", in", ",\nin"))
    axes.axhline(0.0, color="black", linewidth=0.5, zorder=1)
    set_ticks(axes.yaxis, 6 if panel == "displacement" else 4)


def label_time(axes, responses):
    """The common axis of time."""
    unit = responses[0].units["time"]
    axes.set_xlabel(plots.with_unit("time $t$" if unit else r"time $\tau = \omega_1 t$", unit)
                    + (" (units of the scene)" if unit == plots.OF_SCENE else ""))
    axes.set_xlim(min(response.tau[0] for response in responses), max(response.tau[-1] for response in responses))
    set_ticks(axes.xaxis, 10)


def draw_point(axes, surfaces, response):
    """Displacement at one point of the beam, with the surfaces there and the contacts with them."""
    y = surfaces[0].histories["eta"] + surfaces[0].height
    values = [y.min(), y.max()] + [surface.height for surface in surfaces
                                   if min(abs(y - surface.height)) <= 0.5 * (y.max() - y.min()) or y.max() == y.min()]
    margin = 0.08 * (max(values) - min(values))
    low, high = min(values) - margin, max(values) + margin
    axes.set_ylim(low, high)
    for surface in surfaces:
        edge = low if surface.side > 0 else high
        if (edge - surface.height) * surface.side >= 0.0:
            continue
        axes.add_patch(patches.Rectangle((response.tau[0], surface.height), numpy.ptp(response.tau), edge - surface.height,
                                         facecolor="#f2f2f2", edgecolor="none", zorder=0.4))
        if len(surface.contacts) <= MOST_CONTACTS:
            axes.bar([start for start, _ in surface.contacts], edge - surface.height, bottom=surface.height, align="edge",
                     width=[end - start for start, end in surface.contacts], facecolor="#b4b4b4", edgecolor="#b4b4b4",
                     linewidth=0.3, zorder=0.6)
        axes.axhline(surface.height, color="black", linewidth=0.6, zorder=1)
    plots.draw_history(axes, response.tau, y, color="black", linewidth=0.8)
    axes.axhline(0.0, color="black", linewidth=0.4, linestyle=(0, (1, 3)), zorder=1)
    stops = ", ".join(dict.fromkeys(str(surface.stop) for surface in surfaces))
    axes.set_ylabel(plots.with_unit(f"$y$ at stop {stops}", response.units.get("displacement", ""))
                    + f"\n({response.along.place(surfaces[0].position)})", fontsize=9)
    set_ticks(axes.yaxis, 4)
    axes.ticklabel_format(axis="y", style="plain")


def draw_body(axes, body, response):
    """The beam where a body meets it, and the faces of the body: they touch in contact. Lines mark where floor or ceiling stop them."""
    own = [surface for surface in response.surfaces if surface.body == body.number]
    faces = [surface for surface in own if not surface.name.endswith(("floor", "ceiling"))]
    z = body.histories["eta"]
    for start, end in faces[0].contacts if len(faces) == 1 and len(faces[0].contacts) <= MOST_CONTACTS else []:
        axes.axvspan(start, end, facecolor=plots.CONTACT, edgecolor=plots.CONTACT, linewidth=0.4, zorder=0.5)
    handles = plots.draw_history(axes, response.tau, faces[0].histories["eta"] + faces[0].height + z, "beam", color="black",
                                 linewidth=0.8, zorder=3)
    for number, face in enumerate(faces):
        drawn = plots.draw_history(axes, response.tau, z + face.height, f"body {body.number}", linewidth=0.8, zorder=2.5,
                                   color=plots.COLOURS[1], linestyle=plots.DASHES[1])
        handles += drawn if number == 0 else []
    for base in own:
        if base not in faces:
            axes.axhline(base.height + faces[0].height, color=plots.COLOURS[2], linewidth=0.7, linestyle=(0, (1, 1.5)), zorder=1)
            handles.append(plt.Line2D([], [], color=plots.COLOURS[2], linewidth=0.7, linestyle=(0, (1, 1.5)),
                                      label=base.name.split()[-1]))
    if axes.patches:
        handles.append(patches.Patch(facecolor=plots.CONTACT, label="contact"))
    axes.set_ylabel(plots.with_unit("displacement", response.units.get("displacement", ""))
                    + f"\n({response.along.place(body.position)})", fontsize=9)
    set_ticks(axes.yaxis, 5)
    put_small_legend_above(axes, handles)


def draw_sides(axes, response, panel, shown):
    """Velocity at each point and of each body, or force of each side on the beam or on a body, upwards positive."""
    if panel == "velocity":
        points = {surface.position: surface for surface in shown if surface.body == 0}
        curves = [(response.along.place(place), surface.histories["velocity"]) for place, surface in points.items()]
        for body in response.bodies:
            face = next(surface for surface in response.surfaces if surface.body == body.number)
            if body.position not in points:
                curves.append((f"beam at {response.along.place(body.position)}", face.histories["velocity"] + body.histories["velocity"]))
            curves.append((f"body {body.number}", body.histories["velocity"]))
    else:
        curves = [(surface.name, surface.side * surface.histories["force"]) for surface in shown if surface.histories["force"].any()]
    for number, (label, values) in enumerate(curves):
        plots.draw_history(axes, response.tau, values, label, linewidth=0.8, **plots.line_of(number))
    if curves:
        put_small_legend_above(axes)
    else:
        axes.set_title(f"no force: {', '.join(surface.name for surface in shown)}", loc="right", fontsize=9, pad=3)


def draw_places(axes, response, panel):
    """Moment or stress at each place that was asked for."""
    for number, (place, values) in enumerate(zip(response.places, response.of_places[panel])):
        plots.draw_history(axes, response.tau, values, response.along.place(place), linewidth=0.8, **plots.line_of(number))
    put_small_legend_above(axes)


def panels_over_each_other(heights):
    """A figure with panels of these heights in inches."""
    figure, grid = plt.subplots(len(heights), 1, sharex=True, squeeze=False, figsize=(plots.WIDTH, sum(heights) + 0.6),
                                layout="constrained", gridspec_kw={"height_ratios": heights})
    figure.get_layout_engine().set(h_pad=0.01, hspace=0.0)
    return figure, grid


def not_recorded(response, panels):
    """What would record panels that a file has no data for, and the panels that it has data for."""
    names = " or ".join(dict.fromkeys(RECORDED_BY[panel] for panel in panels))
    others = " ".join(panel for panel in PANELS if response.has(panel))
    return plots.Unplottable(f"{response.path}: no {' and no '.join(panels)} was recorded (see {names}); there is --panels {others}")


def draw_several(response, panels):
    """A picture of one response with several stops: a panel for each point, then those of velocity and force."""
    points = {}
    if "displacement" in panels and "eta" in response.surfaces[0].histories:
        for surface in sorted(response.surfaces, key=lambda surface: -surface.position):
            if surface.stop > 0:
                points.setdefault(surface.position, []).append(surface)
    stops = list(dict.fromkeys(surface.stop for surface in response.surfaces))
    others = []
    for panel in panels:
        if panel == "displacement" and not points and "eta_tip" in response.curves:
            others.append((panel, []))
        elif panel in response.of_places or (panel in ("velocity", "force") and panel in response.surfaces[0].histories):
            # forces of many stops have a panel each
            groups = [[surface for surface in response.surfaces if surface.stop == stop] for stop in stops] \
                if panel == "force" and len(stops) > 3 else [response.surfaces]
            others += [(panel, shown) for shown in groups]
    bodies = [body for body in response.bodies if "displacement" in panels and "eta" in body.histories]
    count = len(points) + len(bodies) + len(others)
    if count == 0:
        raise not_recorded(response, panels)
    figure, grid = panels_over_each_other([2.2 if count <= 3 else 1.6] * len(bodies) + [1.35] * (count - len(bodies)))
    panes = list(grid[:, 0])
    for axes, body in zip(panes, bodies):
        draw_body(axes, body, response)
    for axes, surfaces in zip(panes[len(bodies):], points.values()):
        draw_point(axes, surfaces, response)
    for axes, (panel, shown) in zip(panes[len(bodies) + len(points):], others):
        label_panel(axes, panel, response)
        if panel == "displacement":
            put_small_legend_above(axes, draw_tip(axes, response))
        elif panel in OF_PLACES:
            draw_places(axes, response, panel)
        else:
            draw_sides(axes, response, panel, shown)
    unit = "" if response.is_in_units() or not points else "; $y$ in units of $D$"
    # above the legend of the first body
    panes[0].set_title(response.title + unit, pad=19 if bodies else None)
    figure.align_ylabels(panes)
    label_time(panes[-1], [response])
    return figure


def draw_one(response, panels):
    """A picture of one response: panels over each other."""
    if len(response.surfaces) > 1 or response.bodies:
        return draw_several(response, panels)
    drawn = [panel for panel in panels if response.has(panel)]
    if not drawn:
        raise not_recorded(response, panels)
    heights = [2.6 if panel == "displacement" else 1.4 for panel in drawn]
    figure, grid = panels_over_each_other(heights)
    for axes, panel in zip(grid[:, 0], drawn):
        shade_contacts(axes, response)
        label_panel(axes, panel, response)
        if axes is grid[0, 0]:
            axes.set_title(response.title, pad=19 if panel == "displacement" else None)
        if panel == "displacement":
            handles = draw_displacement(axes, response) + legend_of_signs(response)
            put_legend_above(axes, handles)
        elif panel in OF_PLACES:
            draw_places(axes, response, panel)
        else:
            plots.draw_history(axes, response.tau, response.curves[PANELS[panel][0]], color="black", linewidth=0.8)
    figure.align_ylabels(grid[:, 0])
    label_time(grid[-1, 0], [response])
    return figure


def draw_stack(responses):
    """Displacement at the stop of several responses, a panel each."""
    # room for titles of several lines, in the spacing of any version of Matplotlib
    more = 0.19 * max(response.title.count("\n") for response in responses)
    figure, grid = plt.subplots(len(responses), 1, sharex=True, sharey=True, squeeze=False,
                                figsize=(plots.WIDTH, (1.6 + 1.3 * more) * len(responses) + 0.6), gridspec_kw={"hspace": 0.24 + more})
    handles = {}
    for axes, response in zip(grid[:, 0], responses):
        shade_contacts(axes, response)
        label_panel(axes, "displacement", response, r"$y - d$" if response.is_in_units() else r"$\eta$")
        set_ticks(axes.yaxis, 4)
        if not response.has("displacement"):
            raise not_recorded(response, ["displacement"])
        handles.update({handle.get_label(): handle for handle in draw_displacement(axes, response) + legend_of_signs(response)})
        # above the frame, where it covers neither curves nor contacts
        axes.set_title(", ".join(filter(None, [response.title, response.shown_stop()])), loc="right", fontsize="medium", pad=4)
    put_legend_above(grid[0, 0], list(handles.values()), 1.16 + more)
    label_time(grid[-1, 0], responses)
    return figure


def draw_overlay(responses):
    """Displacement at the stop of several responses in one panel."""
    figure, axes = plt.subplots(figsize=(plots.WIDTH, 3.6))
    handles = []
    for number, response in enumerate(responses):
        if "eta_stop" not in response.curves:
            raise plots.Unplottable(f"{response.path}: the displacement at the stop was not recorded (&output histories)")
        handles += plots.draw_history(axes, response.tau, response.curves["eta_stop"], **plots.line_of(number))
    label_panel(axes, "displacement", responses[0])
    titles = [", ".join(filter(None, [response.title, response.shown_stop()])) for response in responses]
    plots.legend_of_titles(axes, handles, titles, loc="upper right")
    label_time(axes, responses)
    return figure


def main():
    """Read the command line, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files")
    parser.add_argument("--panels", nargs="+", choices=list(PANELS), default=["displacement"], metavar="PANEL",
                        help=f"what to plot over each other: {', '.join(PANELS)} (default: displacement)")
    parser.add_argument("--layout", choices=["each", "stack", "overlay"], default="each",
                        help="several files: a picture each (default), a panel each, or all curves in one panel")
    parser.add_argument("--units", choices=["file", "scene", "dimensionless"], default="file",
                        help="as the file has it (default), in the units of the scene, or dimensionless")
    parser.add_argument("--scene-units", action="store_const", dest="units", const="scene", help="the same as --units scene")
    parser.add_argument("--from", dest="start", metavar="TIME", help="beginning of the time shown, such as 0.02 or, in files in units, 20ms")
    parser.add_argument("--to", dest="end", metavar="TIME", help="its end")
    parser.add_argument("--out", type=Path, metavar="PICTURE",
                        help="file of the picture, .png, .pdf or .svg (default: beside the results, .png)")
    arguments = parser.parse_args()
    if arguments.out and arguments.layout == "each" and len(arguments.files) > 1:
        parser.error("--out names one picture: give one file, or --layout stack or overlay")

    responses = [Response(path, arguments.units) for path in arguments.files]
    if arguments.start or arguments.end:
        for response in responses:
            response.cut(arguments.start, arguments.end)
    if arguments.layout == "each":
        for response in responses:
            read_alike([response])
            plots.save(draw_one(response, arguments.panels), arguments.out or response.path.with_suffix(".png"))
    else:
        read_alike(responses)
        figure = draw_stack(responses) if arguments.layout == "stack" else draw_overlay(responses)
        first = responses[0].path
        plots.save(figure, arguments.out or first.with_name(f"{first.stem}_{arguments.layout}.png"))


if __name__ == "__main__":
    plots.run(main)
