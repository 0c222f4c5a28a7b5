#pragma once

/// Everything that needs OpenCL and Eigen only. `fathom/opencv.hpp` and `fathom/io.hpp` come on top.
#include <fathom/camera.hpp>
#include <fathom/cheapest.hpp>
#include <fathom/device.hpp>
#include <fathom/dof.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/error.hpp>
#include <fathom/findings.hpp>
#include <fathom/fog.hpp>
#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/lens.hpp>
#include <fathom/lens_arguments.hpp>
#include <fathom/linearize.hpp>
#include <fathom/normals.hpp>
#include <fathom/photograph.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/precision.hpp>
#include <fathom/probe.hpp>
#include <fathom/projection.hpp>
#include <fathom/quality.hpp>
#include <fathom/ssao.hpp>
#include <fathom/tiles.hpp>
#include <fathom/unproject.hpp>
