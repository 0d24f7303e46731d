# SPDX-License-Identifier: Apache-2.0
"""Writes small 3MF packages, for tests."""

import io
import zipfile

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
OPC = "http://schemas.openxmlformats.org/package/2006"
TYPES = (
    f'<Types xmlns="{OPC}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
RELATIONS = (
    f'<Relationships xmlns="{OPC}/relationships">'
    f'<Relationship Target="/3D/3dmodel.model" Id="r0" Type="{MODEL}"/></Relationships>'
)


def package(model, **more):
    """Returns the bytes of a package with this model; `more` are further files."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in {"[Content_Types].xml": TYPES, "_rels/.rels": RELATIONS, "3D/3dmodel.model": model,
                           **more}.items():
            archive.writestr(name, text)
    return file.getvalue()


def mesh(vertices, triangles):
    """Returns the XML of a mesh."""
    points = "".join('<vertex x="%.9g" y="%.9g" z="%.9g"/>' % tuple(v) for v in vertices)
    corners = "".join('<triangle v1="%d" v2="%d" v3="%d"/>' % tuple(t) for t in triangles)
    return f"<mesh><vertices>{points}</vertices><triangles>{corners}</triangles></mesh>"


def model(resources, build='<item objectid="1"/>', unit="meter", more=""):
    """Returns the XML of a model; `more` are attributes."""
    return (
        f'<model unit="{unit}" xmlns="{CORE}" {more}><resources>{resources}</resources>'
        f"<build>{build}</build></model>"
    )


TRIANGLE = mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
OBJECT = f'<object id="1">{TRIANGLE}</object>'
