#include "infer/live/place.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "autograd/base/error.h"

namespace restage::live {
namespace {

/// The numeric or named host's address; `length` 0: there is none.
SocketAddress look_up(const Place& place) {
  addrinfo how{}, *list = nullptr;
  how.ai_socktype = SOCK_STREAM;
  SocketAddress out;
  if (getaddrinfo(place.host.c_str(), std::to_string(place.port).c_str(), &how, &list) != 0)
    return out;
  for (const addrinfo* one = list; one != nullptr; one = one->ai_next) {
    if (out.length != 0 && one->ai_family != AF_INET) continue;
    out.length = one->ai_addrlen;
    std::memcpy(&out.address, one->ai_addr, one->ai_addrlen);
    if (one->ai_family == AF_INET) break;
  }
  freeaddrinfo(list);
  return out;
}

}  // namespace

bool Place::loopback() const { return host.starts_with("127.") || host == "::1"; }

std::string Place::text() const {
  const bool v6 = host.find(':') != std::string::npos;
  return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Place parse_place(const std::string& text, const std::string& option) {
  const size_t colon = text.rfind(':');
  const bool no_host = colon == std::string::npos || colon == 0;
  Place out{no_host ? "127.0.0.1" : text.substr(0, colon), 0};
  if (out.host.size() > 2 && out.host.front() == '[' && out.host.back() == ']')
    out.host = out.host.substr(1, out.host.size() - 2);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  const char* const end = port.data() + port.size();
  const auto [at, error] = std::from_chars(port.data(), end, out.port);
  if (error != std::errc() || at != end || out.port == 0)
    throw InputError("", option + " '" + text.substr(0, 80) + "' ends in no port",
                     "give a port from 1 to 65535, such as 127.0.0.1:39539");
  return out;
}

Place resolved(const Place& place, const std::string& option) {
  const SocketAddress found = look_up(place);
  char host[NI_MAXHOST];
  if (found.length == 0 ||
      getnameinfo(reinterpret_cast<const sockaddr*>(&found.address), found.length, host,
                  sizeof host, nullptr, 0, NI_NUMERICHOST) != 0)
    throw InputError(
        "", option + " names the host '" + place.host.substr(0, 80) + "', which is not known here",
        "give an address such as 127.0.0.1");
  return {host, place.port};
}

Listener::Listener(const Place& place, const std::string& option) {
  const SocketAddress found = look_up(place);
  fd_ = socket(found.address.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (fd_ >= 0 && setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
      bind(fd_, reinterpret_cast<const sockaddr*>(&found.address), found.length) == 0 &&
      listen(fd_, 8) == 0)
    return;
  const int why = errno;
  if (fd_ >= 0) close(fd_);
  throw InputError("", option + " cannot listen on " + place.text() + ": " + std::strerror(why),
                   why == EADDRINUSE ? "end what uses the port, or give another"
                                     : "give an address of this machine and a free port");
}

Listener::~Listener() { close(fd_); }

Datagrams::Datagrams(const Place& to) : to_(look_up(to)) {
  fd_ = socket(to_.address.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (fd_ < 0 || setsockopt(fd_, SOL_SOCKET, SO_BROADCAST, &on, sizeof on) != 0)
    throw WorkError("cannot make a socket to send to " + to.text() + ": " + std::strerror(errno));
}

Datagrams::~Datagrams() { close(fd_); }

std::string Datagrams::send(std::span<const char> bytes) const {
  return sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to_.address),
                to_.length) < 0
             ? std::strerror(errno)
             : "";
}

}  // namespace restage::live
