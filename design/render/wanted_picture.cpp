// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render/wanted_picture.h"

#include <cmath>

#include "core/image/image.h"
#include "core/optics/light_source.h"
#include "design/flux/surface_projection.h"
#include "design/render.h"

namespace lensforge {
namespace {

/// Zero outside of the picture.
double picture_at(const Image& image, const Eigen::Vector2d& at) {
  const Eigen::Array2d size(image.columns(), image.rows());
  if ((at.array() < 0.0).any() || (at.array() > size).any()) return 0.0;
  return bilinear(image, at);
}

/// wanted − projected; 1 is the value of an evenly lit picture of `total` flux as large as the
/// lens.
Image difference(const Image& wanted, const Image& projected, const OpticalSetup& setup,
                 double total) {
  Image image(wanted.columns(), wanted.rows());
  if (!(total > 0.0)) return image;
  const double unit = total / static_cast<double>(wanted.values().size()) *
                      setup.image_size.prod() / setup.lens_size.prod();
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    const double missing = double{wanted.values()[i]} - double{projected.values()[i]};
    image.values()[i] = static_cast<float>(missing / unit);
  }
  return image;
}

}  // namespace

WantedPicture::WantedPicture(const SurfaceMesh& mesh, const OpticalSetup& setup,
                             const Image& target, const Executor& executor)
    : setup_(lit_from(setup, Eigen::Vector2d::Zero())),
      light_(setup_),
      target_(target),
      executor_(executor),
      reach_(LightPath(setup).reach(1.0, mesh.vertices.row(2).mean()) *
             (traits(setup.body).reflects ? -1.0 : 1.0)) {
  mae_ = evaluate(mesh, setup, SurfaceModel::kSmooth, target, &wanted_, executor).mae;
}

WantedPicture::Comparison WantedPicture::compare(const SurfaceMesh& mesh,
                                                 const Eigen::Matrix3Xd& normals) const {
  Image projected;
  const double mae = evaluate(mesh, normals, setup_, target_, &projected, executor_).mae;
  const Image missing = difference(wanted_, projected, setup_, target_.total());
  Comparison result{mae - mae_, Eigen::VectorXd::Zero(mesh.vertex_count())};
  parallel_for(executor_, "missing flux", mesh.vertex_count(), [&](std::int64_t v) {
    const Eigen::Vector3d n = normals.col(v).normalized();
    const Eigen::Vector3d p = mesh.vertices.col(v);
    if (!light_.transmits(p, n)) return;
    result.missing[v] = picture_at(missing, project_vertex(p, n, light_));
  });
  return result;
}

Eigen::Matrix2d WantedPicture::stretch(const Eigen::Vector3d& p, const Eigen::Vector2d& slope,
                                       const Eigen::Matrix2d& bend) const {
  const Eigen::Vector3d w(-slope.x(), -slope.y(), 1.0);
  const Eigen::Vector3d n = w.normalized();
  if (!light_.transmits(p, n)) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d rows;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d u_bar =
        Eigen::Vector2d::Unit(k).cwiseQuotient(light_.plane().pixels_per_mm());
    Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
    const Eigen::Vector3d n_bar = project_vertex_adjoint(p, n, light_, u_bar, p_bar);
    const Eigen::Vector3d w_bar = normalize_adjoint(n, w.norm(), n_bar);
    rows.row(k) = p_bar.head<2>() + p_bar.z() * slope - bend.transpose() * w_bar.head<2>();
  }
  return rows;
}

}  // namespace lensforge
