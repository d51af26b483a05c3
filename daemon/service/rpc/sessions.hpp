#pragma once
// Who talks to the daemon now.

#include <map>
#include <string>
#include <string_view>

namespace weft::daemon::server {

class Session;

/// Conversations by their sessions' names, "s-41". Used by the server's thread alone.
class Sessions {
 public:
  void add(Session& client_session, std::string_view session) {
    all_.insert_or_assign(std::string(session), &client_session);
  }
  void remove(std::string_view session) {
    if (const auto found = all_.find(session); found != all_.end()) all_.erase(found);
  }
  /// Null where there is none of that name.
  [[nodiscard]] Session* find(std::string_view session) const {
    const auto found = all_.find(session);
    return found == all_.end() ? nullptr : found->second;
  }
  [[nodiscard]] const std::map<std::string, Session*, std::less<>>& all() const { return all_; }

 private:
  std::map<std::string, Session*, std::less<>> all_;
};

}  // namespace weft::daemon::server
