#pragma once
// One table of the API's methods, with parameters and roles. Requests are checked against it, and
// the OpenRPC document is made from it. Source: docs/reference/api.md.

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/rpc/message.hpp"
#include "daemon/service/rpc/tokens.hpp"

namespace weft::daemon::server {
class Session;
/// Open sessions by name, "s-41". Thread: the server's only.
using Sessions = std::map<std::string, Session*, std::less<>>;
}  // namespace weft::daemon::server

namespace weft::daemon::rpc {

enum class ParamType {
  text,
  integer,
  number,
  flag,
  object,
  list,
  id  ///< of a request: a text or a whole number; must be the last type
};

/// For names, notes and reasons [bytes].
constexpr std::size_t longest_text = 1000;

struct ParamSpec {
  std::string_view name;
  ParamType type = ParamType::text;
  bool required = false;
  std::string_view summary;  ///< with the unit, if any
  std::size_t longest = longest_text;
};

enum class Effect {
  read,    ///< changes nothing; may be repeated
  change,  ///< takes an `idem` key, so that a retry after a lost reply has no second effect
};

/// How long the answer to a change with a key is kept.
enum class Memory {
  over_restarts,
  while_running  ///< the answer has a secret, which is not stored, or ends with the daemon, like a
                 ///< lease
};

/// Priority of a call when the server is at its limits.
enum class Urgency {
  usual,
  urgent,  ///< served even when other calls are refused: run stops, rig state
  stop     ///< as urgent, and executed even if the request is faulty; answered with warnings
};

struct MethodSpec {
  std::string_view name;  ///< noun.verb
  std::string_view summary;
  access::Role role = access::Role::observer;  ///< the least role that may call it
  Effect effect = Effect::read;
  std::vector<ParamSpec> params;
  std::string_view result;  ///< description of the result
  Memory memory = Memory::over_restarts;
  Urgency urgency = Urgency::usual;
};

/// The result as JSON, or the error.
using Outcome = tl::expected<std::string, RpcError>;
/// Answers one call. Call exactly once, immediately or later, on the server's thread.
using Responder = std::function<void(Outcome)>;

/// The client of a call.
struct Caller {
  std::string session;  ///< "s-41"
  std::string client;   ///< name that the client gave itself
  std::string user;     ///< from the peer's credentials or the token
  access::Role role = access::Role::observer;
  bool local = false;      ///< connected through the Unix socket
  std::string token = {};  ///< name of its token; empty: none
};

/// "s-41 (ada)": author of a change in the journal and in events.
std::string by(const Caller& caller);

struct Call {
  const nlohmann::json& params;  ///< checked against the method's table
  const Caller& caller;
  server::Session* client_session = nullptr;  ///< null for a call by POST, which has none
  std::weak_ptr<const void> listener = {};    ///< expired when the caller no longer waits
};

using Handler = std::function<void(const Call&, Responder)>;
using DirectHandler = std::function<Outcome(const Call&)>;

class Methods {
 public:
  /// Names must be new. The returned reference is valid as long as the table.
  MethodSpec& add(MethodSpec spec, Handler handler);
  MethodSpec& add(MethodSpec spec, DirectHandler handler);

  struct Entry {
    MethodSpec spec;
    Handler handler;
    bool answers_later = false;  ///< the answer may come later
  };
  /// Errors: method_not_found, with a suggestion.
  [[nodiscard]] tl::expected<const Entry*, RpcError> find(std::string_view name) const;

  /// The OpenRPC 1.2.6 document of all methods.
  [[nodiscard]] std::string open_rpc(std::string_view version) const;

 private:
  MethodSpec& add(Entry entry);

  std::map<std::string, Entry, std::less<>> entries_;
};

/// Errors: the first of unknown names (with a suggestion), missing names, wrong types and texts
/// that are too long.
tl::expected<void, RpcError> check_params(const MethodSpec& spec, const nlohmann::json& params);

/// The valid parameters, and the problems of the others: for requests that are executed in any
/// case. No parameter is required.
struct Usable {
  std::shared_ptr<const nlohmann::json> params;
  std::vector<RpcError> problems;
};
Usable usable_params(const MethodSpec& spec, const nlohmann::json& params);

}  // namespace weft::daemon::rpc
