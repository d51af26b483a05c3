#pragma once
// Bearer tokens for TCP. Their file holds no token, only SHA-256 digests of them: they are 256
// random bits, which no dictionary finds. Source: docs/api.md, Tokens.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/rpc/role.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::access {

struct TokenEntry {
  std::string name;  ///< of a person or program
  Role role = Role::observer;
  std::string sha256;           ///< of the token's text, hexadecimal
  std::int64_t expires_us = 0;  ///< UTC
  /// For whom it acts, "ada": of the machine, or "token:NAME". Empty: for itself, "token:" + name.
  std::string user = {};
};

/// Whose leases and keys are at hand with this token, and whom events name.
std::string user_of(const TokenEntry& entry);

/// The daemon's tokens, one JSON file that only its owner may read.
class TokenFile {
 public:
  /// No file is no tokens. Errors: parse; wrong_state, when others may read or write it.
  static Result<TokenFile> load(const std::filesystem::path& file);

  /// Makes one and returns its text, which is not kept. `user`: TokenEntry's. Errors: io,
  /// invalid_argument (name).
  Result<std::string> add(std::string name, Role role, std::int64_t expires_us,
                          std::string user = {});
  /// Of those whose time is over no more is known.
  void forget_expired(std::int64_t now_us);
  /// Errors: not_found.
  Status remove(std::string_view name);
  /// Mode 0600; whole or not at all.
  Status save() const;

  enum class Wait {
    until_free,  ///< another program is done with it in no time
    not_at_all
  };
  /// Loads the file, lets `work` change it and saves it, while no other program does the same: a
  /// lock on `file`.lock, which stays. Errors: those of load(), `work` and save(); wrong_state,
  /// where it is held and nobody waits.
  static Status change(const std::filesystem::path& file, Wait wait,
                       const std::function<Status(TokenFile&)>& work);

  /// Looks at all entries whatever it finds, so that the time says nothing. Nothing for a token
  /// that is unknown or over.
  [[nodiscard]] std::optional<TokenEntry> find(std::string_view token, std::int64_t now_us) const;
  [[nodiscard]] const std::vector<TokenEntry>& entries() const { return entries_; }

 private:
  std::filesystem::path file_;
  std::vector<TokenEntry> entries_;
};

/// Whether two texts are equal, in a time that depends on their lengths alone.
bool equal_in_constant_time(std::string_view a, std::string_view b);

}  // namespace weft::daemon::access
