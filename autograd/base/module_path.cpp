#include "autograd/base/module_path.h"

#include <atomic>

#include "autograd/base/op_watch.h"

namespace restage {
namespace {

thread_local std::string current_path;
thread_local const char* current_op = nullptr;
thread_local const std::string* backward_path = nullptr;
std::atomic<OpWatcher*> watcher{nullptr};

}  // namespace

ModuleScope::ModuleScope(const std::string& name) : previous_(current_path.size()) {
  if (name.empty()) return;
  if (!current_path.empty()) current_path += '.';
  current_path += name;
}

ModuleScope::~ModuleScope() { current_path.resize(previous_); }

OpScope::OpScope(const char* name) : previous_(current_op) {
  current_op = name;
  if (OpWatcher* told = op_watcher())
    told->begin(name, backward_path != nullptr ? *backward_path : module_path(),
                backward_path != nullptr ? OpWatcher::Kind::backward : OpWatcher::Kind::forward);
}
OpScope::~OpScope() {
  current_op = previous_;
  if (OpWatcher* told = op_watcher()) told->end();
}

void watch_ops(OpWatcher* told) { watcher.store(told); }
OpWatcher* op_watcher() { return watcher.load(std::memory_order_acquire); }

BackwardPath::BackwardPath(const std::string& path) : previous_(backward_path) {
  backward_path = &path;
}
BackwardPath::~BackwardPath() { backward_path = previous_; }

std::string module_path() { return current_path.empty() ? "(no module)" : current_path; }

std::string running_op() {
  return (current_op != nullptr ? "'" + std::string(current_op) + "' in " : "") + module_path();
}

}  // namespace restage
