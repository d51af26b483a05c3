#pragma once
// One client's session: lines in, lines out, no socket. Sends the greeting, opens the session,
// checks each request and calls its method. Also the state shared by all sessions, and the files
// that methods pass to the transport. Source: docs/reference/api.md.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/base/file/read_file.hpp"
#include "daemon/service/rpc/event_hub.hpp"
#include "daemon/service/rpc/idempotency.hpp"
#include "daemon/service/rpc/message.hpp"
#include "daemon/service/rpc/method.hpp"
#include "daemon/service/rpc/rate_limits.hpp"
#include "daemon/service/rpc/tokens.hpp"

namespace weft::daemon::server {

inline constexpr std::string_view protocol_version = "1.0";

/// Path prefix of files: "/data/R-000318/dataset.h5".
inline constexpr std::string_view data_path = "/data/";
/// Path that Prometheus reads.
inline constexpr std::string_view metrics_path = "/metrics";

/// A file that a client may download; its bytes match its list entry. If the file is modified, its
/// stamp changes and it is no longer served.
struct ServedFile {
  std::shared_ptr<const OpenFile> file;
  OpenFile::Stamp as_of;
  std::string sha256;  ///< digest of its bytes, used as the entity tag
};

/// Known facts about a peer before its first message.
struct Peer {
  bool local = false;                     ///< connected through the Unix socket
  std::string user = {};                  ///< from the peer's credentials; empty on TCP
  std::optional<access::Role> role = {};  ///< from the peer's credentials; TCP needs a token
  bool stays = true;                      ///< can receive events; a single HTTP request cannot
  std::string address = {};  ///< "192.0.2.7", an IPv6 network "2001:db8::"; empty: local
};

/// User, role and entry of a token.
struct TokenOwner {
  std::string user;
  access::Role role = access::Role::observer;
  access::TokenEntry token = {};
};

/// Requests of all sessions since the daemon started [count].
struct RequestCounts {
  std::uint64_t reads = 0, changes = 0, stops = 0;  ///< that reached a method
  std::uint64_t refused = 0;                        ///< answered with an error
  std::uint64_t wrong_tokens = 0;
};

/// State shared by all sessions of a server; must outlive them.
struct Shared {
  const rpc::Methods* methods = nullptr;
  Hub* hub = nullptr;
  access::IdempotencyCache* answered = nullptr;
  std::string epoch;  ///< identifies this start of the daemon
  /// Errors: one wording for every defect of a token, so that guessing reveals nothing.
  std::function<Result<TokenOwner>(std::string_view token)> token_owner;
  std::function<std::string()> readiness_json;
  /// Handles the raw line "!halt", with or without spaces around it. Only from the Unix socket;
  /// needs no session.
  std::function<void(const rpc::Caller&)> halt;
  std::function<Clock()> now;
  /// Opens a file for HTTP, by "R-000318/dataset.h5". `callback` is called on the server's thread,
  /// immediately or later. Errors: not_found; others, if the file differs from its list entry.
  using FileCallback = std::function<void(const Result<ServedFile>&)>;
  std::function<void(std::string_view path, const FileCallback& callback)> file = {};
  /// True while the result of token_owner() is still valid. Unset: always.
  std::function<bool(const TokenOwner&)> is_token_valid = {};
  /// Handles the raw line "!estop", as halt. Unset: the line is refused.
  std::function<void(const rpc::Caller&)> emergency_stop = {};
  /// Body of GET /metrics, as OpenMetrics or as the older text format of Prometheus.
  std::function<std::string(bool is_open_metrics)> metrics_text = {};
  Sessions sessions = {};
  RequestCounts counts = {};
  /// For clients that are not on the Unix socket.
  access::RateLimits rates = {};
  access::RefusedTokens refused_tokens = {};
  /// Reports a refused token: `from` is the client's address, or the user on the Unix socket.
  std::function<void(std::string_view from)> on_token_refused = {};
};

/// The first request of every client.
const rpc::MethodSpec& session_open();
/// Adds session.open to the table, so that rpc.discover lists it and a second call is refused.
void add_session_open(rpc::Methods& methods);

/// "$/cancel": answers a waiting call with "request.cancelled".
void add_cancel(rpc::Methods& methods);

class Session {
 public:
  /// Requests that may wait for their answers at a time [count].
  static constexpr std::size_t most_pending = 64;
  static constexpr std::size_t most_subscriptions = 64;
  /// A longer answer is refused, with a hint how to request less [bytes].
  static constexpr std::size_t most_answer_bytes = std::size_t{3} << 20;
  /// Wrong tokens on one connection before it is closed.
  static constexpr std::size_t most_wrong_tokens = 5;

  using Send = std::function<void(std::string line)>;
  Session(Shared& shared, Peer peer, std::string session, Send send);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Call once, when the peer has connected.
  void send_hello();
  /// `line`: one line without its end.
  void on_message(std::string_view line);
  /// Handles the bytes after the last line when the peer has finished. Executes a halt without a
  /// line end and returns true; ignores anything else.
  bool on_unfinished_message(std::string_view rest);
  /// True while the session uses a slot that is reserved for halts: only urgent calls are accepted.
  void restrict_to_emergency(bool so) { only_urgent_ = so; }
  /// Sends the subscriptions' events while `has_space()` is true.
  void pump(const std::function<bool()>& has_space);

  /// Ends the session. The client receives the reason after the lines that are already queued.
  void end(rpc::RpcError why) { ended_ = std::move(why); }
  /// Answers a waiting call with "request.cancelled"; the method's own answer is discarded. Errors:
  /// not_found; wrong_state for a change, which is executed anyway.
  Status cancel(const std::string& id_json);
  /// Why the session is over: it was ended, or the client's token is no longer valid. Earlier
  /// requests are completed, but not answered.
  [[nodiscard]] std::optional<rpc::RpcError> over() const;

  [[nodiscard]] const rpc::Caller& caller() const { return caller_; }
  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] std::size_t wrong_tokens() const { return wrong_tokens_; }
  /// The session's own, for the methods of sub.*. Thread: the server's only.
  using Subscriptions = std::map<std::string, std::shared_ptr<Subscription>, std::less<>>;
  Subscriptions& subscriptions() { return subscriptions_; }
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }

 private:
  void halt(std::string_view kind, const std::function<void(const rpc::Caller&)>& stop);
  void handle(const rpc::Request& request);
  /// The method, if it is a stop that this peer may call now; otherwise null.
  [[nodiscard]] const rpc::Methods::Entry* stop_named(const std::string& method) const;
  void stop(const rpc::Methods::Entry& entry, const rpc::Request& request,
            const rpc::RpcError* wrong);
  rpc::Outcome open_session(const nlohmann::json& params);
  rpc::RpcError wrong_token(const Error& why);
  /// True if too many tokens of its address were refused recently. Never true for the Unix socket.
  [[nodiscard]] bool is_limited() const;
  [[nodiscard]] std::optional<rpc::RpcError> refusal(const rpc::MethodSpec& spec) const;
  void dispatch(const rpc::Methods::Entry& entry, const rpc::Request& request);
  void answer(const std::optional<std::string>& id_json, const rpc::Outcome& outcome);

  Shared* shared_;
  Peer peer_;
  rpc::Caller caller_;
  Send send_;
  bool is_open_ = false;
  bool only_urgent_ = false;
  bool opened_limited_ = false;  ///< opened while its address was limited
  std::size_t wrong_tokens_ = 0;
  std::optional<TokenOwner> owner_;  ///< owner of the token that it came with
  /// A request without its answer yet. `listener` expires when the caller no longer waits.
  struct Pending {
    std::optional<std::string> id_json;
    bool changes = false;
    std::shared_ptr<const bool> listener = std::make_shared<const bool>(true);
  };
  std::map<std::uint64_t, Pending> pending_;  // by number
  std::uint64_t next_request_ = 0;
  std::optional<rpc::RpcError> ended_;
  Subscriptions subscriptions_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace weft::daemon::server
