// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/host_device.h"
#include "core/optics/outline.h"
#include "design/optics/image_triangle.h"

namespace lensforge {

/// The image of a part of a face.
LF_HD inline ImageTriangle image_of(const ImageTriangle& face, const TrianglePiece& piece) {
  const auto corner = [&](int k) -> Eigen::Vector2d {
    return piece.weights(0, k) * face.p0 + piece.weights(1, k) * face.p1 +
           piece.weights(2, k) * face.p2;
  };
  return {corner(0), corner(1), corner(2), piece.share * face.flux};
}

/// Adjoint of image_of(): adds to the derivatives by the face's image.
LF_HD inline void image_of_adjoint(const TrianglePiece& piece, const ImageTriangle& bar,
                                   ImageTriangle& face_bar) {
  const auto corner = [&](int j) -> Eigen::Vector2d {
    return piece.weights(j, 0) * bar.p0 + piece.weights(j, 1) * bar.p1 +
           piece.weights(j, 2) * bar.p2;
  };
  face_bar.p0 += corner(0);
  face_bar.p1 += corner(1);
  face_bar.p2 += corner(2);
  face_bar.flux += piece.share * bar.flux;
}

}  // namespace lensforge
