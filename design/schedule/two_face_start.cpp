// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <span>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/optics/screen.h"
#include "core/spline/control_net.h"
#include "design/schedule/two_faces.h"

namespace lensforge {
namespace {

/// Newton's method has its last, quadratic steps at a hundredth: one more costs little.
constexpr double kMassTolerance = 1e-3;
constexpr int kMaxSteps = 150;

/// Transport of equal rays to a picture. Points are millimetres on a plane.
class Transport {
 public:
  Transport(const Executor& executor, const RunControl& control)
      : executor_(executor), control_(control) {
    options_.tolerance = kMassTolerance;
    options_.max_newton_steps = kMaxSteps;
  }

  /// Where the light of every point goes.
  Eigen::Matrix2Xd operator()(const Eigen::Matrix2Xd& from, const ImagePlane& plane,
                              const Image& light) {
    Eigen::Matrix2Xd sites(2, from.cols());
    for (Eigen::Index k = 0; k < from.cols(); ++k) sites.col(k) = plane.to_pixels(from.col(k));
    const Eigen::VectorXd masses =
        Eigen::VectorXd::Constant(from.cols(), 1.0 / static_cast<double>(from.cols()));
    TransportResult result =
        solve_semi_discrete(sites, masses, light, options_, executor_, control_);
    if (result.status == TransportResult::Status::kStopped) throw Interrupted();
    converged_ = converged_ && result.converged();
    if (result.centroids.cols() == 0) return from;
    for (Eigen::Index k = 0; k < from.cols(); ++k) {
      sites.col(k) = plane.to_mm(result.centroids.col(k));
    }
    return sites;
  }

  [[nodiscard]] bool converged() const { return converged_; }

 private:
  const Executor& executor_;
  const RunControl& control_;
  TransportOptions options_;
  bool converged_ = true;
};

/// Middles of the cells of an even grid over a picture, mm.
Eigen::Matrix2Xd even_points(const OpticalSetup& setup, const GridShape& shape) {
  Eigen::Matrix2Xd points(2, Eigen::Index{shape.columns} * shape.rows);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Eigen::Index row = k / shape.columns;
    const Eigen::Array2d cell(static_cast<double>(k - row * shape.columns) + 0.5,
                              static_cast<double>(row) + 0.5);
    points.col(k) = setup.image_origin.array() +
                    cell / Eigen::Array2d(shape.columns, shape.rows) * setup.image_size.array();
  }
  return points;
}

/// A grid of a picture's points within a ring of points at its edges, or one step further out where
/// its light ends before them. A point of the ring has its neighbour's place along the edge.
Eigen::Matrix2Xd with_ring(const Eigen::Matrix2Xd& points, const GridShape& shape,
                           const OpticalSetup& setup) {
  const GridShape ringed{shape.columns + 2, shape.rows + 2};
  Eigen::Matrix2Xd all(2, Eigen::Index{ringed.columns} * ringed.rows);
  const auto at = [&](const Eigen::Array2i& cell) -> Eigen::Array2d {
    return points.col(Eigen::Index{cell.y()} * shape.columns + cell.x());
  };
  const Eigen::Array2i last(shape.columns - 1, shape.rows - 1);
  const Eigen::Array2d low = setup.image_origin;
  const Eigen::Array2d high = low + setup.image_size.array();
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    const Eigen::Array2i cell(static_cast<int>(k % ringed.columns) - 1,
                              static_cast<int>(k / ringed.columns) - 1);
    const Eigen::Array2i nearest = cell.max(0).min(last);
    const Eigen::Array2i inner = (2 * nearest - cell).max(0).min(last);
    const Eigen::Array2d here = at(nearest);
    const Eigen::Array2d step = (here - at(inner)).abs();
    Eigen::Array2d place = here;
    for (int i = 0; i < 2; ++i) {
      if (cell[i] < 0) place[i] = std::max(low[i], here[i] - step[i]);
      if (cell[i] > last[i]) place[i] = std::min(high[i], here[i] + step[i]);
    }
    all.col(k) = place;
  }
  return all;
}

/// The front as a picture's place.
OpticalSetup front_of(OpticalSetup setup) {
  setup.front.reset();
  setup.image_size = setup.lens_size;
  setup.image_origin.setZero();
  return setup;
}

/// The lamp's light on a flat front, pixel by pixel.
Image light_on_front(const OpticalSetup& front) {
  const LightPath light(front);
  const ImagePlane plane(front);
  Image image(front.pixels.x(), front.pixels.y());
  for (int r = 0; r < image.rows(); ++r) {
    for (int c = 0; c < image.columns(); ++c) {
      const auto corner = [&](int i, int j) -> Eigen::Vector3d {
        const Eigen::Vector2d mm = plane.to_mm(Eigen::Vector2d(c + i, r + j));
        return {mm.x(), mm.y(), 0.0};
      };
      // A view from behind turns the triangles over.
      const double taken = light.intake({corner(0, 0), corner(1, 0), corner(1, 1)}) +
                           light.intake({corner(0, 0), corner(1, 1), corner(0, 1)});
      image.at(c, r) = static_cast<float>(std::fabs(taken));
    }
  }
  return image;
}

/// Points of a screen in the lens frame.
Eigen::Matrix3Xd in_space(const Eigen::Matrix2Xd& mm, const OpticalSetup& setup) {
  const ImagePlane plane(setup);
  const Screen screen(setup);
  Eigen::Matrix3Xd points(3, mm.cols());
  for (Eigen::Index k = 0; k < mm.cols(); ++k) {
    points.col(k) = screen.at(plane.to_pixels(mm.col(k)));
  }
  return points;
}

}  // namespace

RayBundle two_plane_map(const PlanePicture& first, const PlanePicture& second,
                        const GridShape& rays, double exit_height, const Executor& executor,
                        const RunControl& control) {
  Transport transport(executor, control);
  const ImagePlane near(first.setup);
  const ImagePlane far(second.setup);
  const Eigen::Matrix2Xd inner_a = transport(even_points(first.setup, rays), near, first.light);
  const Eigen::Matrix2Xd inner_b = transport(inner_a, far, second.light);
  const OpticalSetup front = front_of(first.setup);
  const auto exits = [&](const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
    Eigen::Matrix2Xd e(2, a.cols());
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      const Eigen::Vector3d way = b.col(k) - a.col(k);
      e.col(k) = (a.col(k) + (exit_height - a(2, k)) / way.z() * way).head<2>();
    }
    return e;
  };
  const Eigen::Matrix2Xd inner_e =
      exits(in_space(inner_a, first.setup), in_space(inner_b, second.setup));
  const Eigen::Matrix2Xd inner_p = transport(inner_e, ImagePlane(front), light_on_front(front));
  RayBundle bundle;
  bundle.first = in_space(with_ring(inner_a, rays, first.setup), first.setup);
  bundle.second = in_space(with_ring(inner_b, rays, second.setup), second.setup);
  bundle.exit = exits(bundle.first, bundle.second);
  bundle.entry = with_ring(inner_p, rays, front);
  bundle.converged = transport.converged();
  return bundle;
}

namespace {

/// Weight of bending in fit_spline_slopes(): a wave of four cells keeps all but 0.3 % of its slope.
constexpr double kBending = 1e-4;

/// Weight of the squared heights, which slopes leave open.
constexpr double kTrace = 1e-9;

/// Of fit_spline_slopes(): relative residual at which it is solved, maximum number of iterations,
/// and how many pass between two looks for a stop request: 0.2 s with 40,000 coefficients.
constexpr double kSolved = 1e-8;
constexpr int kMaxIterations = 2000;
constexpr int kIterationsAtOnce = 50;

/// Rounds of faces_along(): heights change where rays meet the faces, by less each time.
constexpr int kRounds = 3;

/// A spline's basis functions at a point of the lens.
struct PointBasis {
  CubicBasis x;
  CubicBasis y;

  PointBasis(const Eigen::Vector2d& point, const Eigen::Vector2d& size,
             const Eigen::Vector2i& cells)
      : x(along(point.x() / size.x(), cells.x())), y(along(point.y() / size.y(), cells.y())) {}

 private:
  static CubicBasis along(double share, int cells) {
    return cubic_basis(std::clamp(share, 0.0, 1.0) * cells, cells);
  }
};

/// A coefficient and its factor in a linear term.
struct Factor {
  int i;
  int j;
  double value;
};

/// Normal equations of linear terms in a spline's coefficients, each of at most four coefficients
/// each way.
class NormalEquations {
 public:
  explicit NormalEquations(const Eigen::Vector2i& cells)
      : columns_(cells.x() + kSplineDegree),
        right_(Eigen::VectorXd::Zero(Eigen::Index{columns_} * (cells.y() + kSplineDegree))),
        band_(Eigen::MatrixXd::Zero(kWidth * kWidth, right_.size())) {}

  /// Adds weight × (Σ factor × coefficient − value)².
  void add(std::span<const Factor> factors, double value, double weight) {
    for (const Factor& s : factors) {
      const Eigen::Index k = Eigen::Index{s.j} * columns_ + s.i;
      right_[k] += weight * s.value * value;
      for (const Factor& t : factors) {
        band_((t.j - s.j + kReach) * kWidth + t.i - s.i + kReach, k) += weight * s.value * t.value;
      }
    }
  }

  /// By conjugate gradients. @throw Interrupted
  [[nodiscard]] Eigen::MatrixXd solution(const RunControl& control) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index k = 0; k < right_.size(); ++k) {
      for (int n = 0; n < kWidth * kWidth; ++n) {
        if (band_(n, k) == 0.0) continue;
        const Eigen::Index other = k + (n / kWidth - kReach) * columns_ + n % kWidth - kReach;
        entries.emplace_back(static_cast<int>(k), static_cast<int>(other), band_(n, k));
      }
    }
    Eigen::SparseMatrix<double> matrix(right_.size(), right_.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper,
                             Eigen::IncompleteCholesky<double>>
        solver(matrix);
    solver.setTolerance(kSolved);
    solver.setMaxIterations(kIterationsAtOnce);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(right_.size());
    for (int done = 0; done < kMaxIterations; done += kIterationsAtOnce) {
      if (control.stop_requested()) throw Interrupted();
      x = solver.solveWithGuess(right_, x);
      if (solver.info() == Eigen::Success) break;
    }
    return x.reshaped(columns_, right_.size() / columns_);
  }

 private:
  static constexpr int kReach = 3;
  static constexpr int kWidth = 2 * kReach + 1;

  int columns_;
  Eigen::VectorXd right_;
  Eigen::MatrixXd band_;  ///< A column per coefficient: its row of the matrix.
};

/// Adds both slopes of a point.
void add_slopes(const PointBasis& at, const Eigen::Vector2d& per_mm, const Eigen::Vector2d& wanted,
                NormalEquations& equations) {
  std::array<Factor, 16> by_x{};
  std::array<Factor, 16> by_y{};
  for (std::size_t n = 0; n < 16; ++n) {
    const std::size_t i = n % 4;
    const std::size_t j = n / 4;
    by_x[n] = by_y[n] = {at.x.first + static_cast<int>(i), at.y.first + static_cast<int>(j), 0.0};
    by_x[n].value = per_mm.x() * at.x.slope[i] * at.y.value[j];
    by_y[n].value = per_mm.y() * at.x.value[i] * at.y.slope[j];
  }
  equations.add(by_x, wanted.x(), 1.0);
  equations.add(by_y, wanted.y(), 1.0);
}

/// Adds the changes of slope between neighbouring cells, and a trace of the heights.
void add_bending(const Eigen::Vector2i& cells, const Eigen::Vector2d& per_mm, double weight,
                 NormalEquations& equations) {
  const double x = per_mm.x();
  const double y = per_mm.y();
  const auto add = [&](std::initializer_list<Factor> factors, double times) {
    equations.add({factors.begin(), factors.size()}, 0.0, times);
  };
  for (int j = 0; j < cells.y() + kSplineDegree; ++j) {
    for (int i = 0; i < cells.x() + kSplineDegree; ++i) {
      add({{i, j, 1.0}}, kTrace * per_mm.squaredNorm());
      if (i > 1) add({{i, j, x}, {i - 1, j, -2.0 * x}, {i - 2, j, x}}, weight);
      if (j > 1) add({{i, j, y}, {i, j - 1, -2.0 * y}, {i, j - 2, y}}, weight);
      if (i > 0 && j > 0) {
        add({{i, j, x}, {i - 1, j, -x}, {i, j - 1, -x}, {i - 1, j - 1, x}}, 2.0 * weight);
      }
    }
  }
}

double height_at(const Eigen::MatrixXd& coefficients, const PointBasis& at) {
  double z = 0.0;
  for (std::size_t j = 0; j < 4; ++j) {
    for (std::size_t i = 0; i < 4; ++i) {
      z += at.x.value[i] * at.y.value[j] *
           coefficients(at.x.first + static_cast<int>(i), at.y.first + static_cast<int>(j));
    }
  }
  return z;
}

/// Values of a spline at every knot.
Eigen::MatrixXd knot_values(const Eigen::MatrixXd& coefficients) {
  const auto basis = [](Eigen::Index count) {
    std::vector<double> knots;
    for (int k = 0; k + kSplineDegree < count + 1; ++k) knots.push_back(k);
    return Eigen::MatrixXd(basis_matrix(knots, static_cast<int>(knots.size()) - 1, false));
  };
  return basis(coefficients.rows()) * coefficients * basis(coefficients.cols()).transpose();
}

/// Gradient of the height field that turns the unit direction `before` into `behind`, at indices
/// `n_before` and `n_behind`: by Snell's law their difference is along the normal.
Eigen::Vector2d turning_gradient(const Eigen::Vector3d& before, double n_before,
                                 const Eigen::Vector3d& behind, double n_behind) {
  const Eigen::Vector3d normal = n_behind * behind - n_before * before;
  return -normal.head<2>() / normal.z();
}

/// The faces of a bundle as they are fitted, round by round.
class BundleFit {
 public:
  BundleFit(const RayBundle& bundle, const OpticalSetup& setup, const FacePlan& plan,
            const RunControl& control)
      : bundle_(bundle),
        setup_(setup),
        plan_(plan),
        control_(control),
        front_cells_(plan.front.columns - 1, plan.front.rows - 1),
        exit_cells_(plan.net.columns - kSplineDegree, plan.net.rows - kSplineDegree),
        size_(setup.lens_size),
        entry_(3, bundle.entry.cols()),
        exit_(3, bundle.entry.cols()),
        slopes_(2, bundle.entry.cols()) {
    entry_ << bundle.entry, Eigen::RowVectorXd::Constant(bundle.entry.cols(), -plan.room);
    exit_.row(2).setConstant(plan.thickness + plan.room);
    place_exits();
  }

  void fit_front() {
    for (Eigen::Index k = 0; k < entry_.cols(); ++k) {
      const Eigen::Vector3d p = entry_.col(k);
      const Eigen::Vector3d inside = (exit_.col(k) - p).normalized();
      slopes_.col(k) = turning_gradient(before(p), 1.0, inside, setup_.ior);
    }
    front_ = fit_spline_slopes(entry_.topRows<2>(), slopes_, size_, front_cells_, control_);
    front_.array() -= front_.maxCoeff() + plan_.room;
    set_heights(front_, front_cells_, entry_);
  }

  /// From the rays that the fitted front makes, so that its errors do not turn the light.
  void fit_exit() {
    OpticalSetup setup = setup_;
    setup.front = height_front(knot_values(front_), size_);
    const LightSource behind(setup);
    for (Eigen::Index k = 0; k < exit_.cols(); ++k) {
      const Eigen::Vector3d e = exit_.col(k);
      const IncidentRay ray =
          ray_from_near(behind.front(), behind.before_front(), e, entry_.col(k).head<2>());
      Eigen::Vector3d inside = (e - entry_.col(k)).normalized();
      if (ray.m.allFinite()) inside = ray.direction();
      slopes_.col(k) = turning_gradient(way_out(k).normalized(), 1.0, inside, setup.ior);
    }
    exit_face_ = fit_spline_slopes(exit_.topRows<2>(), slopes_, size_, exit_cells_, control_);
    exit_face_.array() += plan_.thickness + plan_.room - exit_face_.minCoeff();
    set_heights(exit_face_, exit_cells_, exit_);
    place_exits();
  }

  [[nodiscard]] LensFaces faces() const {
    LensFaces faces{Eigen::Matrix3Xd(3, exit_face_.size()), knot_values(front_)};
    for (int j = 0; j < plan_.net.rows; ++j) {
      for (int i = 0; i < plan_.net.columns; ++i) {
        faces.exit.col(Eigen::Index{j} * plan_.net.columns + i)
            << size_.x() * greville_point(i, exit_cells_.x()) / exit_cells_.x(),
            size_.y() * greville_point(j, exit_cells_.y()) / exit_cells_.y(), exit_face_(i, j);
      }
    }
    return faces;
  }

 private:
  void set_heights(const Eigen::MatrixXd& face, const Eigen::Vector2i& cells,
                   Eigen::Matrix3Xd& points) const {
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      points(2, k) = height_at(face, PointBasis(points.col(k).head<2>(), size_, cells));
    }
  }
  /// Direction of the lamp's light at a point.
  [[nodiscard]] Eigen::Vector3d before(const Eigen::Vector3d& p) const {
    const auto place = lamp_place(setup_.lamp);
    if (place) return (p - *place).normalized();
    return std::get<ParallelLight>(setup_.lamp).direction;
  }
  /// A ray's way behind the lens, 1 mm long in z.
  [[nodiscard]] Eigen::Vector3d way_out(Eigen::Index k) const {
    const Eigen::Vector3d way = bundle_.second.col(k) - bundle_.first.col(k);
    return way / way.z();
  }
  /// Puts the points of exit on their rays, at their heights.
  void place_exits() {
    for (Eigen::Index k = 0; k < exit_.cols(); ++k) {
      const double rise = exit_(2, k) - bundle_.first(2, k);
      exit_.col(k).head<2>() = (bundle_.first.col(k) + rise * way_out(k)).head<2>();
    }
  }

  const RayBundle& bundle_;
  const OpticalSetup& setup_;
  const FacePlan& plan_;
  const RunControl& control_;
  Eigen::Vector2i front_cells_;
  Eigen::Vector2i exit_cells_;
  Eigen::Vector2d size_;
  Eigen::Matrix3Xd entry_;
  Eigen::Matrix3Xd exit_;
  Eigen::Matrix2Xd slopes_;
  Eigen::MatrixXd front_;  ///< Coefficients.
  Eigen::MatrixXd exit_face_;
};

}  // namespace

Eigen::MatrixXd fit_spline_slopes(const Eigen::Matrix2Xd& points, const Eigen::Matrix2Xd& slopes,
                                  const Eigen::Vector2d& size, const Eigen::Vector2i& cells,
                                  const RunControl& control) {
  const Eigen::Vector2d per_mm = cells.cast<double>().cwiseQuotient(size);
  NormalEquations equations(cells);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    add_slopes(PointBasis(points.col(k), size, cells), per_mm, slopes.col(k), equations);
  }
  const double per_cell = static_cast<double>(points.cols()) / cells.cast<double>().prod();
  add_bending(cells, per_mm, kBending * per_cell, equations);
  Eigen::MatrixXd heights = equations.solution(control);
  heights.array() -= heights.mean();
  return heights;
}

LensFaces faces_along(const RayBundle& bundle, const OpticalSetup& setup, const FacePlan& plan,
                      const RunControl& control) {
  BundleFit fit(bundle, setup, plan, control);
  for (int round = 0; round < kRounds; ++round) {
    fit.fit_front();
    fit.fit_exit();
  }
  return fit.faces();
}

}  // namespace lensforge
