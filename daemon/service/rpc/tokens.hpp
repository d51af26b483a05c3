#pragma once
// Roles, and bearer tokens for TCP. The file has only SHA-256 digests of the tokens, which are 256
// random bits and therefore safe from dictionary attacks. Source: docs/reference/api.md, Tokens.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon::access {

/// Four roles; each includes the rights of the previous ones. Role of each method:
/// docs/reference/api.md.
enum class Role : std::uint8_t {
  observer,   ///< reads
  operator_,  ///< runs recipes
  engineer,   ///< edits recipes and limits within the hard caps; simulated faults
  admin,      ///< tokens, hard caps, other users' leases
};

std::string_view to_string(Role role);
std::optional<Role> role_from(std::string_view name);

struct TokenEntry {
  std::string name;  ///< name of a person or program
  Role role = Role::observer;
  std::string sha256;           ///< digest of the token's text, hexadecimal
  std::int64_t expires_us = 0;  ///< UTC
  /// The user for whom it acts: "ada" of the machine, or "token:NAME". Empty: "token:" + name.
  std::string user = {};
};

/// The user of leases, keys and events of this token.
std::string user_of(const TokenEntry& entry);

/// The daemon's tokens: one JSON file that only its owner may read.
class TokenFile {
 public:
  /// A missing file means no tokens. Errors: parse; wrong_state, if others may read or write it.
  static Result<TokenFile> load(const std::filesystem::path& file);

  /// Creates a token and returns its text, which is not stored. `user`: as in TokenEntry. Errors:
  /// io, invalid_argument (name).
  Result<std::string> add(std::string name, Role role, std::int64_t expires_us,
                          std::string user = {});
  /// Removes expired tokens.
  void forget_expired(std::int64_t now_us);
  /// Errors: not_found.
  Status remove(std::string_view name);
  /// Writes the file with mode 0600, atomically.
  Status save() const;

  enum class Wait {
    until_free,  ///< other programs hold the lock only briefly
    not_at_all
  };
  /// Loads the file, changes it with `work` and saves it. Holds a lock on `file`.lock, which stays,
  /// against other programs. Errors: those of load(), `work` and save(); wrong_state, if it is
  /// locked and `wait` is not_at_all.
  static Status change(const std::filesystem::path& file, Wait wait,
                       const std::function<Status(TokenFile&)>& work);

  /// Always compares all entries, so that the time reveals nothing. Empty for a token that is
  /// unknown or expired.
  [[nodiscard]] std::optional<TokenEntry> find(std::string_view token, std::int64_t now_us) const;
  [[nodiscard]] const std::vector<TokenEntry>& entries() const { return entries_; }

 private:
  std::filesystem::path file_;
  std::vector<TokenEntry> entries_;
};

/// The daemon's tokens as in their file now: another program may add or remove one meanwhile.
/// Thread: one. Checking the file's stamp takes a microsecond; the file is read when the stamp has
/// changed.
class TokenKeeper {
 public:
  /// Errors: those of TokenFile::load().
  static Result<TokenKeeper> open(const std::filesystem::path& file);

  /// The entry of a token. Empty if it is unknown or expired.
  std::optional<TokenEntry> find(std::string_view token, std::int64_t now_us);
  /// True if a result of find() is still valid: it has not expired and was not removed.
  [[nodiscard]] bool is_valid(const TokenEntry& entry, std::int64_t now_us) const;
  /// Adds a new token to the current file and removes expired ones. Errors: those of
  /// TokenFile::change() and add().
  Result<std::string> add(std::string name, Role role, std::int64_t expires_us, std::string user,
                          std::int64_t now_us);
  /// Errors: those of TokenFile::change() and remove().
  Status remove(std::string_view name);
  /// Reads the file if it has changed. If it cannot be used, the known tokens stay valid, problem()
  /// has the reason, and the next call tries again.
  void refresh();
  /// Why the current file could not be read; empty if it could.
  [[nodiscard]] const std::optional<Error>& problem() const { return problem_; }

 private:
  /// Identifies a version of the file; all 0 if there is none.
  struct Stamp {
    std::uint64_t device = 0, inode = 0;
    std::int64_t bytes = 0, changed_ns = 0;
    bool operator==(const Stamp&) const = default;
  };
  TokenKeeper(std::filesystem::path file, TokenFile tokens, const Stamp& as_of)
      : file_(std::move(file)), tokens_(std::move(tokens)), as_of_(as_of) {}
  static Stamp read_stamp(const std::filesystem::path& file);

  std::filesystem::path file_;
  TokenFile tokens_;
  Stamp as_of_;
  std::optional<Error> problem_;
};

}  // namespace weft::daemon::access
