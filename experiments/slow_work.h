// Says on standard error what a command is doing if that takes long.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace restage {

/// Work that takes under two seconds goes without a word. From then on a line says what is being
/// done, and every five seconds what is being done by then.
class SlowWork {
 public:
  SlowWork();
  ~SlowWork();
  SlowWork(const SlowWork&) = delete;
  SlowWork& operator=(const SlowWork&) = delete;
  /// What begins now, such as "reading real.h5"; "": nothing that is worth a word. Interrupted if
  /// the program was asked to stop.
  void on(std::string what);

 private:
  void watch();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::string what_, said_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace restage
