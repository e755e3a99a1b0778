#include "datasets/fetch/download.h"

#include <curl/curl.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"

namespace restage {
namespace {

struct Sink {
  FILE* file;
  uint64_t room;
  bool too_long = false;
};

size_t take(char* data, size_t, size_t count, void* user) {
  Sink& sink = *static_cast<Sink*>(user);
  sink.too_long = count > sink.room;
  if (sink.too_long) return 0;
  sink.room -= count;
  return std::fwrite(data, 1, count, sink.file);
}

int keep_on(void*, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return stop_requested() ? 1 : 0;
}

void init_once() {
  static const CURLcode done = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (done != CURLE_OK) throw WorkError("downloads are not possible: libcurl does not start");
}

}  // namespace

void download(const std::string& address, const std::string& part, uint64_t bytes) {
  init_once();
  std::error_code none;
  uint64_t have = std::filesystem::file_size(part, none);
  if (!none && have == bytes) return;
  if (none || have > bytes) have = 0;
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(part.c_str(), have > 0 ? "ab" : "wb"),
                                                   std::fclose);
  if (!file) throw WorkError(part + ": cannot be written; check space and permissions");
  const std::unique_ptr<CURL, void (*)(CURL*)> curl(curl_easy_init(), curl_easy_cleanup);
  if (!curl) throw WorkError("downloads are not possible: libcurl does not start");
  Sink sink{file.get(), bytes - have, false};
  const auto set = [&](CURLoption option, auto value) {
    curl_easy_setopt(curl.get(), option, value);
  };
  set(CURLOPT_URL, address.c_str());
  set(CURLOPT_PROTOCOLS_STR, "https,file");
  set(CURLOPT_FOLLOWLOCATION, 1L);
  set(CURLOPT_REDIR_PROTOCOLS_STR, "https");
  set(CURLOPT_FAILONERROR, 1L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT, 20L);
  set(CURLOPT_LOW_SPEED_LIMIT, 100L);  // bytes a second, for
  set(CURLOPT_LOW_SPEED_TIME, 60L);    // seconds: then it has broken off
  set(CURLOPT_USERAGENT, "restage");
  set(CURLOPT_WRITEFUNCTION, &take);
  set(CURLOPT_WRITEDATA, static_cast<void*>(&sink));
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &keep_on);
  if (have > 0) set(CURLOPT_RESUME_FROM_LARGE, static_cast<curl_off_t>(have));
  const CURLcode done = curl_easy_perform(curl.get());
  throw_if_stopped();
  if (done == CURLE_OK && std::fflush(file.get()) == 0) return;
  const bool full = done == CURLE_OK || (done == CURLE_WRITE_ERROR && !sink.too_long);
  const char* why = full            ? "the disk is full"
                    : sink.too_long ? "it is longer than the list says"
                                    : curl_easy_strerror(done);
  throw WorkError(address + ": cannot be fetched (" + why +
                  "); check the network and run it again, or give {source} FOLDER");
}

void make_folder_of(const std::string& path) {
  std::error_code failed;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failed);
  if (failed) throw WorkError(path + ": its folder cannot be made; check space and permissions");
}

void put_in_place(const std::string& part, const std::string& target) {
  std::error_code failed;
  std::filesystem::rename(part, target, failed);
  if (failed) throw WorkError(target + ": cannot be put in place; check permissions");
}

}  // namespace restage
