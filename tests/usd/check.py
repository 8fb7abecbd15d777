#!/usr/bin/env python3
"""Reads a USD file with OpenUSD's own library (PyPI: usd-core) and prints what is in it as JSON.

    python3 tests/usd/check.py FILE TIME_CODE [EVERY]

Printed are the issues that USD's validators find, units and up axis, the joints, and for each mesh its display colour of the first
vertex, its counts, and every EVERY-th of its points as UsdSkel skins them at the time code.
"""
import json
import sys

from pxr import Usd, UsdGeom, UsdSkel, UsdValidation, Vt


def issues(stage):
    """What USD's own validators, which `usdchecker` runs too, have to say."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    return [error.GetErrorAsString() for error in UsdValidation.ValidationContext(validators).Validate(stage)]


def main():
    path, time, every = sys.argv[1], Usd.TimeCode(float(sys.argv[2])), int((sys.argv[3:] or ["1"])[0])
    stage = Usd.Stage.Open(path)
    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    meshes, joints = {}, []
    for binding in cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
        skeleton = cache.GetSkelQuery(binding.GetSkeleton())
        joints = [str(j) for j in skeleton.GetJointOrder()]
        transforms = skeleton.ComputeSkinningTransforms(time)
        for target in binding.GetSkinningTargets():
            mesh = UsdGeom.Mesh(target.GetPrim())
            points = Vt.Vec3fArray(mesh.GetPointsAttr().Get())
            done = target.ComputeSkinnedPoints(transforms, points, time)
            color = mesh.GetDisplayColorPrimvar().Get()
            meshes[target.GetPrim().GetCustomDataByKey("name")] = {
                "skinned": bool(done),
                "vertices": len(points),
                "triangles": len(mesh.GetFaceVertexCountsAttr().Get()),
                "normals": len(mesh.GetNormalsAttr().Get()),
                "color": list(color[0]) if color else None,
                "points": [list(p) for p in points[::every]],
            }
    json.dump(
        {
            "issues": issues(stage),
            "metres_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
            "up": UsdGeom.GetStageUpAxis(stage),
            "rate": stage.GetTimeCodesPerSecond(),
            "end": stage.GetEndTimeCode(),
            "joints": joints,
            "meshes": meshes,
        },
        sys.stdout,
    )


main()
