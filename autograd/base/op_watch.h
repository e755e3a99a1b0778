// Who watches ops and phases of a step as they run: a profile of a training. Where nobody watches,
// an op asks one number.
#pragma once

#include <string>

namespace restage {

class OpWatcher {
 public:
  enum class Kind { forward, backward, phase };
  virtual ~OpWatcher() = default;
  /// Something begins on this thread. `path`: the module.
  virtual void begin(const char* name, const std::string& path, Kind kind) = 0;
  /// What began last on this thread ends.
  virtual void end() = 0;
};

/// From now on `watcher` is told, on the threads that compute; null: nobody. It must live until no
/// op runs.
void watch_ops(OpWatcher* watcher);
OpWatcher* op_watcher();

/// Ops that begin on this thread are backward passes of ops of a module.
class BackwardPath {
 public:
  /// `path` must live as long.
  explicit BackwardPath(const std::string& path);
  ~BackwardPath();
  BackwardPath(const BackwardPath&) = delete;
  BackwardPath& operator=(const BackwardPath&) = delete;

 private:
  const std::string* previous_;
};

}  // namespace restage
