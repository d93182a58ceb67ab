"""Scenes: descriptions of runs, with the keys of a scene file."""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from cdem import _engine
from cdem._names import unknown
from cdem.errors import SceneError
from cdem.mesh import Mesh

_TABLES = ("time", "contact", "output")
_LISTS = ("material", "block", "boundary", "load", "probe")


class Table(dict[str, Any]):
    """A table of a scene. Its keys are also attributes: `scene.time.end` is
    `scene.time["end"]`.
    """

    _place: str | None = None
    # Key of the table in the scene, or "" for the scene itself; None if unknown. For hints.

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        known = _known_keys().get(self._place or "", []) if self._place is not None else [key]
        if key not in self and key not in known:
            where = f"{self._place}: " if self._place else ""
            raise AttributeError(where + unknown("key", key, known))
        if key == "pair" and key not in self:
            self[key] = _wrapped(Tables(), key)
        try:
            return self[key]
        except KeyError:
            raise AttributeError(f"the key `{key}` is not set") from None

    def __setattr__(self, key: str, value: Any) -> None:
        self[key] = _wrapped(value, key)

    def __delattr__(self, key: str) -> None:
        self.pop(key, None)


class Tables(list[Table]):
    """A list of tables, such as `scene.block`."""

    _place: str | None = None

    def add(self, **keys: Any) -> Table:
        """Adds a table with these keys and returns it."""
        self.append(_wrapped(keys, self._place))
        return self[-1]


class Scene:
    """The description of a run: materials, blocks, loads, contact, output.

    A scene comes from a file or a dictionary, or is built key by key. The attributes are the keys
    of scene files: tables, as in `scene.time.end = 0.5`, and lists of tables, as in
    `scene.block.add(name="i", …)`. Numbers are in SI units, or text with a unit such as
    `"40 GPa"`. The `mesh` of a block is a path, a `cdem.Mesh` or a `meshio.Mesh`.

    `check()` reports errors; so does the creation of a simulation.
    """

    def __init__(
        self,
        keys: Mapping[str, Any] | None = None,
        /,
        *,
        directory: str | os.PathLike[str] = ".",
        **more: Any,
    ) -> None:
        """A scene with the keys of a dictionary, and with more keys; without any, an empty scene.

        keys: the keys of a scene file; `version = 1` may be left out.
        directory: the folder to which paths of meshes are relative.

        Raises `SceneError` if `keys` is no dictionary.
        """
        given = _keys_of(keys) if keys is not None else {}
        self.__dict__["_directory"] = Path(directory).absolute()
        self.__dict__["_file"] = None
        self.__dict__["_keys"] = _wrapped({"version": 1, **given, **more}, "")

    @classmethod
    def _of(cls, keys: Mapping[str, Any]) -> Scene:
        """A scene with keys that must be given."""
        return cls(_keys_of(keys))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene in a file. Errors give line and column.

        Raises `SceneError`.
        """
        path = Path(path)
        if path.is_dir() and (path / "scene.toml").is_file():
            raise SceneError(
                f"cannot read the scene {path}: it is a folder; did you mean {path / 'scene.toml'}?"
            )
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SceneError(f"cannot read the scene {path}: {error}") from None
        return cls.parse(text, path)

    @classmethod
    def parse(cls, text: str, path: str | os.PathLike[str] = "scene.toml") -> Scene:
        """The scene in a TOML text; `path` is the path of its file, which need not exist.

        Raises `SceneError`.
        """
        _engine.written(_engine.Source(text, True, path))
        scene = cls(directory=Path(path).parent)
        keys = tomllib.loads(text)
        scene.__dict__["_keys"] = _wrapped(keys, "")
        # Messages give the lines of the file while the keys are unchanged.
        scene.__dict__["_file"] = (text, Path(path), _plain(keys, "", {}))
        return scene

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        if key not in self._keys and key in _TABLES:
            self._keys[key] = _wrapped({}, key)
        if key not in self._keys and key in _LISTS:
            self._keys[key] = _wrapped(Tables(), key)
        return getattr(self._keys, key)

    def __setattr__(self, key: str, value: Any) -> None:
        setattr(self._keys, key, value)

    def __delattr__(self, key: str) -> None:
        delattr(self._keys, key)

    def __repr__(self) -> str:
        title = self._keys.get("title") or "untitled"
        blocks = len(self._keys.get("block", ()))
        return f"<cdem.Scene: {title}, {blocks} block{'s' * (blocks != 1)}>"

    @property
    def directory(self) -> Path:
        """The folder to which paths of meshes are relative."""
        directory: Path = self._directory
        return directory

    def to_dict(self) -> dict[str, Any]:
        """The keys that are set, as plain dictionaries and lists. Meshes are not converted."""
        plain: dict[str, Any] = _unwrapped(self._keys)
        return plain

    def copy(self) -> Scene:
        """An independent scene with the same keys."""
        return Scene(self.to_dict(), directory=self._directory)

    def check(self) -> None:
        """Checks all keys, alone and against each other. It does not read meshes.

        Raises `SceneError`.
        """
        _engine.written(self._source()[0])

    def to_toml(self) -> str:
        """The scene as the text of a file, with all defaults filled in. Meshes from arrays have
        no path; `write` gives them one.

        Raises `SceneError`.
        """
        source, meshes = self._source()
        if meshes:
            raise SceneError(f"{next(iter(meshes))} comes from arrays and has no file; write(path) writes one")
        return _engine.written(source)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene to a file for `cdem run`, with all defaults filled in, and meshes from
        arrays beside it. Their names consist of the name of the scene and the number of the
        block, as in wall-1.msh. Files with these names are replaced.

        Raises `SceneError` and `MeshError`. If the scene has an error, no file is written.
        """
        path = Path(path)
        written = self.copy()
        meshes: dict[str, Mesh] = {}
        names: dict[int, str] = {}
        for number, block in enumerate(written._keys.get("block", ()), 1):
            mesh = block.get("mesh")
            if isinstance(mesh, (str, os.PathLike)):
                where = (self._directory / mesh).resolve()
                block["mesh"] = os.path.relpath(where, path.parent.resolve())
            elif mesh is not None:
                block["mesh"] = names.setdefault(id(mesh), f"{path.stem}-{number}.msh")
                meshes[block["mesh"]] = Mesh.of(mesh)
        text = written.to_toml()
        for name, mesh in meshes.items():
            mesh.write(path.parent / name)
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise SceneError(f"cannot write the scene {path}: {error}") from None

    def _source(self) -> tuple[_engine.Source, dict[str, Mesh]]:
        """The scene for the engine, and the meshes from arrays by their paths in it."""
        meshes: dict[str, Mesh] = {}
        keys = _plain(self._keys, "", meshes)
        file = self._file
        if file is not None and file[2] == keys and not meshes:
            return _engine.Source(file[0], True, file[1]), {}
        return _engine.Source(json.dumps(keys), False, self._directory), meshes


def _keys_of(keys: Any) -> Mapping[str, Any]:
    """The keys of a scene; refuses anything but a dictionary."""
    if not isinstance(keys, Mapping):
        raise SceneError(
            f"a scene needs a dictionary of its keys, not a value of type {type(keys).__name__}; "
            "Scene.read(path) reads a file"
        )
    return keys


@cache
def _known_keys() -> dict[str, list[str]]:
    """The keys of each table of a scene, by the key of the table; "" is the scene."""
    schema = json.loads(_engine.schema())
    tables = {name: table.get("properties", {}) for name, table in schema["$defs"].items()}
    known = {"": list(schema["properties"])}
    for table in (schema["properties"], *tables.values()):
        for key, value in table.items():
            for name in re.findall(r"#/\$defs/(\w+)", json.dumps(value)):
                if tables[name]:
                    known[key] = list(tables[name])
    return known


def _wrapped(value: Any, place: str | None) -> Any:
    """Tables and lists of tables, as types with their keys as attributes.

    place: the key of the table or list.
    """
    if isinstance(value, Mapping):
        table = Table((str(key), _wrapped(inner, str(key))) for key, inner in value.items())
        table.__dict__["_place"] = place
        return table
    is_list = isinstance(value, Tables) or (isinstance(value, (list, tuple)) and len(value) > 0)
    if is_list and all(isinstance(inner, Mapping) for inner in value):
        tables = Tables(_wrapped(inner, place) for inner in value)
        tables._place = place
        return tables
    # A later change of the array by its owner must not change the scene.
    return value.copy() if isinstance(value, np.ndarray) else value


def _unwrapped(value: Any) -> Any:
    """Plain dictionaries and lists again."""
    if isinstance(value, Mapping):
        return {key: _unwrapped(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_unwrapped(inner) for inner in value]
    return value.copy() if isinstance(value, np.ndarray) else value


def _plain(value: Any, path: str, meshes: dict[str, Mesh]) -> Any:
    """A value for JSON. Meshes from arrays go to `meshes`; their names take their place."""
    if isinstance(value, (str, bool, int)):
        return value
    if value is None:
        raise SceneError(f"{path}: must not be None; leave out or delete the key for its default")
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if re.fullmatch(r"block\[\d+\]\.mesh", path):
        return _name_of(Mesh.of(value), path, meshes)
    if isinstance(value, (float, np.floating)):
        if not math.isfinite(value):
            raise SceneError(f"{path}: must be a finite number")
        return float(value)
    if isinstance(value, Mapping):
        inner = {key: _plain(v, f"{path}.{key}" if path else key, meshes) for key, v in value.items()}
        # A read access creates an empty table.
        return {key: v for key, v in inner.items() if not (v in ({}, []) and key in (*_TABLES, *_LISTS, "pair"))}
    if isinstance(value, np.ndarray) or isinstance(value, np.generic):
        return _plain(value.tolist(), path, meshes)
    if isinstance(value, Sequence):
        return [_plain(v, f"{path}[{i}]", meshes) for i, v in enumerate(value)]
    kind = type(value).__name__
    raise SceneError(f"{path}: a value of type {kind} cannot be part of a scene")


def _name_of(mesh: Mesh, path: str, meshes: dict[str, Mesh]) -> str:
    """The name of the mesh from arrays at `path`."""
    known = [name for name, other in meshes.items() if other is mesh]
    name = known[0] if known else f"{mesh.name} of {path.removesuffix('.mesh')}"
    meshes[name] = mesh
    return name
