// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/convergence.h"

#include <sstream>

namespace lensforge {

std::string convergence_csv(const std::vector<ConvergenceRow>& rows) {
  std::ostringstream out;
  out.precision(9);
  out << "stage,level,round,iteration,image,unlit,gradient,boundary,barrier,face,edge,laplacian,"
         "align,"
         "flux,total,mass_error,mae,seconds\n";
  for (const ConvergenceRow& r : rows) {
    const EnergyValues& e = r.energy;
    out << r.stage << ',' << r.level << ',' << r.round << ',' << r.iteration;
    for (const double value :
         {e.image, e.unlit, e.gradient, e.boundary, e.barrier, e.face, e.edge, e.laplacian, e.align,
          e.flux, e.total, r.mass_error, r.mae, r.seconds}) {
      out << ',' << value;
    }
    out << '\n';
  }
  return out.str();
}

}  // namespace lensforge
