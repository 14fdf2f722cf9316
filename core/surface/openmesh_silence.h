// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenMesh/Core/System/omstream.hh>

namespace lensforge {

/// Keeps OpenMesh from printing while it lives; errors are reported by exceptions instead.
class OpenMeshSilence {
 public:
  OpenMeshSilence() { omerr().disable(), omout().disable(), omlog().disable(); }
  ~OpenMeshSilence() { omerr().enable(), omout().enable(), omlog().enable(); }
  OpenMeshSilence(const OpenMeshSilence&) = delete;
  OpenMeshSilence& operator=(const OpenMeshSilence&) = delete;
};

}  // namespace lensforge
