// SHA-256 (and git's SHA-1), by OpenSSL: the only place that knows it.
#pragma once

#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // OpenSSL's EVP_MD_CTX

namespace restage {

/// Takes bytes piece by piece.
class Sha256 {
 public:
  Sha256();
  void add(std::string_view bytes);
  std::string hex();  ///< 64 digits; ends the sum

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
};

std::string sha256(std::string_view bytes);
/// Whether a text is such a sum: 64 hexadecimal digits in small letters.
bool is_sha256(std::string_view text);
/// 40 digits; only for what git names by it.
std::string sha1(std::string_view bytes);
/// Of a file, in constant memory. ReadError if it cannot be read to its end.
std::string sha256_of_file(const std::string& path);

}  // namespace restage
