#include "experiments/cli/output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "autograd/base/error.h"

namespace restage::cli {
namespace {

thread_local Captured* captured = nullptr;

[[noreturn]] void fail() {
  throw WorkError(std::string("standard output could not be written (") + std::strerror(errno) +
                  "); free some space or keep the reader of the pipe open");
}

}  // namespace

Captured::Captured() : before_(captured) { captured = this; }
Captured::~Captured() { captured = before_; }

void print(const std::string& text) {
  if (captured != nullptr) {
    captured->text += text;
    return;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) fail();
}

void print_json(const Json& document) {
  // Names in files may hold any bytes; replace what is not UTF-8 instead of failing.
  print(document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void print(bool json, const Json& document, const std::string& text) {
  json ? print_json(document) : print(text);
}

void finish_output() {
  if (std::fflush(stdout) != 0) fail();
}

void print_error(const std::string& text) { std::fputs((error_line(text) + "\n").c_str(), stderr); }

}  // namespace restage::cli
