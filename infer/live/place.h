// Addresses that a user writes: where to send, where to listen.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <span>
#include <string>

namespace restage::live {

struct Place {
  std::string host;  ///< a numeric address once resolved()
  uint16_t port = 0;
  bool loopback() const;  ///< of a numeric address: it cannot be reached from another machine
  std::string text() const;
};

/// "HOST:PORT", "[::1]:PORT", ":PORT" or "PORT"; without a host 127.0.0.1. InputError that names
/// `option`: no port from 1 to 65535.
Place parse_place(const std::string& text, const std::string& option);
/// The same with the host as a numeric address, IPv4 if there is one. InputError: no such host.
Place resolved(const Place& place, const std::string& option);

struct SocketAddress {
  sockaddr_storage address{};
  socklen_t length = 0;  ///< 0: there is none
};

/// A TCP socket that listens, closed with this value. InputError naming `option`: the port is in
/// use, or the address is none of this machine.
class Listener {
 public:
  Listener(const Place& place, const std::string& option);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

/// Sends datagrams (UDP) to one address.
class Datagrams {
 public:
  /// `to`: resolved().
  explicit Datagrams(const Place& to);
  ~Datagrams();
  Datagrams(const Datagrams&) = delete;
  Datagrams& operator=(const Datagrams&) = delete;
  /// Returns why it could not be sent; empty: it has been handed to the system. Whether anybody
  /// listens is not known.
  std::string send(std::span<const char> bytes) const;

 private:
  SocketAddress to_;
  int fd_ = -1;
};

}  // namespace restage::live
