#pragma once
// The daemon's tokens as their file has them now: somebody may add or remove one while it runs.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/tokens.hpp"

namespace weft::daemon::access {

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
