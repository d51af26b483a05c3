#pragma once
// Roles, and bearer tokens for TCP. Their file holds no token, only SHA-256 digests of them: they
// are 256 random bits, which no dictionary finds. Source: docs/api.md, Tokens.

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

/// Who may do what: four roles, each with everything that the ones before it may. Which method
/// needs which: docs/api.md.
enum class Role : std::uint8_t {
  observer,   ///< reads
  operator_,  ///< runs recipes
  engineer,   ///< edits recipes and limits within the hard caps, simulated faults
  admin,      ///< tokens, hard caps, other people's leases
};

std::string_view to_string(Role role);
std::optional<Role> role_from(std::string_view name);

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

/// The daemon's tokens as their file has them now: somebody may add or remove one while it runs.
/// Used by one thread. A look at the file's stamp costs a microsecond; it is read when that
/// changed.
class TokenKeeper {
 public:
  /// Errors: TokenFile::load()'s.
  static Result<TokenKeeper> open(const std::filesystem::path& file);

  /// Whose it is. Nothing for a token that is unknown or over.
  std::optional<TokenEntry> find(std::string_view token, std::int64_t now_us);
  /// Whether what find() told once is so still: its time is not over and it was not removed.
  [[nodiscard]] bool is_valid(const TokenEntry& entry, std::int64_t now_us) const;
  /// A new one, in what the file holds now; those whose time is over are forgotten.
  /// Errors: TokenFile::change()'s, and add()'s.
  Result<std::string> add(std::string name, Role role, std::int64_t expires_us, std::string user,
                          std::int64_t now_us);
  /// Errors: TokenFile::change()'s, and remove()'s.
  Status remove(std::string_view name);
  /// Reads the file where it is another one. One that cannot be used changes nothing: what was
  /// known stays good, problem() says so, and the next call tries again.
  void refresh();
  /// Why the file, as it is now, could not be read; nothing where it could.
  [[nodiscard]] const std::optional<Error>& problem() const { return problem_; }

 private:
  /// Of the file; all 0 where there is none.
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
