#pragma once
// Answers to changes that were asked for with a key: a client that lost the reply asks again and
// gets the same one. Source: design/API.md, 2.7.

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/rpc/method.hpp"

namespace weft::daemon::access {

class IdempotencyCache {
 public:
  static constexpr std::size_t most_kept = 4096;

  enum class Found { fresh, answered, under_way, other_request };
  struct Look {
    Found found = Found::fresh;
    std::optional<rpc::Outcome> outcome;  ///< where it is answered
  };
  /// A key belongs to a user: nobody reads another's answer with it. `fingerprint`: of method and
  /// parameters. A fresh key is under way from here on.
  Look look(std::string_view user, std::string_view key, std::string_view fingerprint);
  void answered(std::string_view user, std::string_view key, const rpc::Outcome& outcome);

 private:
  struct Entry {
    std::string fingerprint;
    std::optional<rpc::Outcome> outcome;
    std::list<std::string>::iterator age;
  };
  std::map<std::string, Entry, std::less<>> entries_;  // by user and key
  std::list<std::string> by_age_;                      // oldest first
};

}  // namespace weft::daemon::access
