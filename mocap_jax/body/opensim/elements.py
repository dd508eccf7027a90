"""Reading numbers, words and switches of OpenSim's XML, with messages that name the place."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from mocap_jax.errors import InputError


def parse_document(text: str, name: str) -> Element:
    """Root element `OpenSimDocument`.

    Document types are refused: models have none, and entities can blow up any reader.

    Raises:
        InputError: not XML, or not an OpenSim document.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{name}: document type declarations are not accepted in OpenSim models")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{name}: not well-formed XML: {error}") from error
    if root.tag != "OpenSimDocument":
        raise InputError(f"{name}: the document is <{root.tag}>, not <OpenSimDocument>")
    return root


def text_of(element: Element, tag: str, default: str = "") -> str:
    """Text of a child, without white space around it."""
    return (element.findtext(tag) or default).strip()


def switch_of(element: Element, tag: str, default: bool = False) -> bool:
    """Whether a child says true."""
    return text_of(element, tag, str(default)).lower() in ("true", "1")


def numbers_of(
    element: Element, tag: str, where: str, count: int | None = None, default: str | None = None
) -> np.ndarray:
    """Finite numbers of a child.

    Raises:
        InputError: the child is missing, or holds other than `count` numbers.
    """
    words = (text_of(element, tag) or default or "").split()
    try:
        numbers = np.array([float(w) for w in words])
    except ValueError as error:
        raise InputError(f"{where}: <{tag}>: {error}") from error
    if not len(numbers) or not np.isfinite(numbers).all():
        raise InputError(f"{where}: <{tag}> must hold finite numbers, not '{' '.join(words)}'")
    if count is not None and len(numbers) != count:
        raise InputError(f"{where}: <{tag}> must hold {count} numbers, not {len(numbers)}")
    return numbers


def objects_of(model: Element, set_name: str) -> list[Element]:
    """Members of a set such as `<BodySet><objects>`."""
    objects = model.find(f"{set_name}/objects")
    return [] if objects is None else list(objects)
