#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders a glTF scene with VTK's dual depth peeling, exactly: no limit on peels or on the remainder.

    vtk_peeling.py SCENE WIDTH HEIGHT CAMERA_JSON PICTURE

The camera is the JSON that benchmark_capture prints. First renders and saves an untimed picture, and prints the
versions as a line of JSON; then renders one picture per input line, and prints the milliseconds of Render() until the
last command is done. Needs a display.

The peeling pass is set explicitly, to exclude VTK's older one. Surfaces have Phong shading, which is less work than the
importer's choice (Cook-Torrance, like peeler's).
"""
import json
import pathlib
import struct
import sys
import time

import vtk


def glass_alpha(scene):
    """Returns the common alpha of all BLEND materials, because VTK 9.1's importer drops it."""
    data = pathlib.Path(scene).read_bytes()
    document = json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])
    alphas = {material["pbrMetallicRoughness"]["baseColorFactor"][3]
              for material in document["materials"] if material.get("alphaMode") == "BLEND"}
    if len(alphas) != 1:
        raise SystemExit(f"{scene}: BLEND materials of one alpha are expected, not {sorted(alphas)}")
    return alphas.pop()


def camera_of(renderer, numbers):
    camera = renderer.GetActiveCamera()
    camera.SetPosition(numbers["eye"])
    camera.SetFocalPoint(numbers["target"])
    camera.SetViewUp(numbers["up"])
    camera.SetViewAngle(numbers["fov"])
    renderer.ResetCameraClippingRange()


def peeling():
    peel = vtk.vtkDualDepthPeelingPass()
    peel.SetTranslucentPass(vtk.vtkTranslucentPass())
    peel.SetMaximumNumberOfPeels(10000)
    peel.SetOcclusionRatio(0.0)
    passes = vtk.vtkRenderPassCollection()
    for each in (vtk.vtkLightsPass(), vtk.vtkOpaquePass(), peel):
        passes.AddItem(each)
    sequence = vtk.vtkSequencePass()
    sequence.SetPasses(passes)
    camera = vtk.vtkCameraPass()
    camera.SetDelegatePass(sequence)
    return camera


def main():
    scene, width, height, camera, picture = sys.argv[1:]
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    window.SetSize(int(width), int(height))
    importer = vtk.vtkGLTFImporter()
    importer.SetFileName(scene)
    importer.SetRenderWindow(window)
    importer.Update()
    renderer = window.GetRenderers().GetFirstRenderer()
    actors, alpha = list(renderer.GetActors()), glass_alpha(scene)
    for actor in actors:
        actor.GetProperty().SetInterpolationToPhong()
        if actor.GetForceTranslucent():
            actor.GetProperty().SetOpacity(alpha)
    camera_of(renderer, json.loads(camera))
    renderer.SetPass(peeling())

    def render():
        start = time.perf_counter()
        window.Render()
        window.WaitForCompletion()
        return 1000 * (time.perf_counter() - start)

    render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()
    translucent = sum(actor.HasTranslucentPolygonalGeometry() for actor in actors)
    print(json.dumps({"version": vtk.vtkVersion.GetVTKVersion(), "actors": len(actors),
                      "translucent": translucent, "renderer": window.ReportCapabilities().split(
                          "OpenGL renderer string:")[1].splitlines()[0].strip()}), flush=True)
    for _ in sys.stdin:
        print(render(), flush=True)


if __name__ == "__main__":
    main()
