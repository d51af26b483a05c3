#pragma once
// The methods of the API: what each takes and who may call it, in one table from which requests are
// checked and the OpenRPC document is made. Source: docs/api.md.

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
/// Who talks to the daemon now, by session name, "s-41". Used by the server's thread alone.
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
  id  ///< of a request: a text or a whole number; the last type
};

/// Texts are names, notes and reasons [bytes].
constexpr std::size_t longest_text = 1000;

struct ParamSpec {
  std::string_view name;
  ParamType type = ParamType::text;
  bool required = false;
  std::string_view summary;  ///< with the unit, where it has one
  std::size_t longest = longest_text;
};

enum class Effect {
  read,    ///< changes nothing; may be asked again
  change,  ///< takes an `idem` key, so that a retry after a lost reply does nothing twice
};

/// For how long the answer to a change with a key is remembered.
enum class Memory {
  over_restarts,
  while_running  ///< it holds a secret, which is not written down, or ends with the daemon, as a
                 ///< lease
};

/// What a call is worth where there is no more room.
enum class Urgency {
  usual,
  urgent,  ///< served where others are refused for want of room: stops of a run, how the rig stands
  stop     ///< so, and whatever else is wrong with the request: it is done, and told with warnings
};

struct MethodSpec {
  std::string_view name;  ///< noun.verb
  std::string_view summary;
  access::Role role = access::Role::observer;  ///< the least that may call it
  Effect effect = Effect::read;
  std::vector<ParamSpec> params;
  std::string_view result;  ///< what comes back, in words
  Memory memory = Memory::over_restarts;
  Urgency urgency = Urgency::usual;
};

/// The result as JSON, or why not.
using Outcome = tl::expected<std::string, RpcError>;
/// Answers one call; once, at once or later, on the server's thread.
using Responder = std::function<void(Outcome)>;

/// Who calls.
struct Caller {
  std::string session;  ///< "s-41"
  std::string client;   ///< as it called itself
  std::string user;     ///< of the peer's credentials or of the token
  access::Role role = access::Role::observer;
  bool local = false;      ///< came through the Unix socket
  std::string token = {};  ///< name of the one that he came with; empty: with none
};

/// "s-41 (ada)": who made a change, as the journal and events have it.
std::string by(const Caller& caller);

struct Call {
  const nlohmann::json& params;  ///< checked against the method's table
  const Caller& caller;
  server::Session* client_session = nullptr;  ///< null for a call by POST, which has none
  std::weak_ptr<const void> listener = {};    ///< gone when nobody waits for the answer
};

using Handler = std::function<void(const Call&, Responder)>;
using DirectHandler = std::function<Outcome(const Call&)>;

class Methods {
 public:
  /// Names must be new. What comes back lives as long as the table.
  MethodSpec& add(MethodSpec spec, Handler handler);
  MethodSpec& add(MethodSpec spec, DirectHandler handler);

  struct Entry {
    MethodSpec spec;
    Handler handler;
    bool answers_later = false;  ///< the caller may have to wait
  };
  /// Errors: method_not_found, with a did-you-mean.
  [[nodiscard]] tl::expected<const Entry*, RpcError> find(std::string_view name) const;

  /// The OpenRPC 1.2.6 document of all methods.
  [[nodiscard]] std::string open_rpc(std::string_view version) const;

 private:
  MethodSpec& add(Entry entry);

  std::map<std::string, Entry, std::less<>> entries_;
};

/// Unknown names (with a did-you-mean), missing ones, wrong types, texts that are too long; the
/// first problem.
tl::expected<void, RpcError> check_params(const MethodSpec& spec, const nlohmann::json& params);

/// The parameters that a method can use, and what is wrong with the others: for those that are
/// heeded all the same. Nothing is required.
struct Usable {
  std::shared_ptr<const nlohmann::json> params;
  std::vector<RpcError> problems;
};
Usable usable_params(const MethodSpec& spec, const nlohmann::json& params);

}  // namespace weft::daemon::rpc
