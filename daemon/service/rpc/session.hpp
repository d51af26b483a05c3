#pragma once
// One client's side of the server: lines in, lines out; no socket. Greets, lets it introduce
// itself, checks each request and hands it to its method. Also what all sessions share, and the
// files that methods hand to the transport. Source: docs/api.md.

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

/// Where files are: "/data/R-000318/dataset.h5".
inline constexpr std::string_view data_path = "/data/";
/// Where Prometheus reads.
inline constexpr std::string_view metrics_path = "/metrics";

/// A file that a client may download. It is what its list says; once somebody writes to it, its
/// stamp is another, and it is not.
struct ServedFile {
  std::shared_ptr<const OpenFile> file;
  OpenFile::Stamp as_of;
  std::string sha256;  ///< of its bytes; it is the entity tag
};

/// What is known of a peer before it says a word.
struct Peer {
  bool local = false;                     ///< came through the Unix socket
  std::string user = {};                  ///< by the peer's credentials; empty on TCP
  std::optional<access::Role> role = {};  ///< by the peer's credentials; TCP needs a token
  bool stays = true;                      ///< can be sent events; a single HTTP request cannot
  std::string address = {};  ///< "192.0.2.7", an IPv6 network "2001:db8::"; empty: local
};

/// Whose token this is, and until when.
struct TokenOwner {
  std::string user;
  access::Role role = access::Role::observer;
  access::TokenEntry token = {};
};

/// Requests since the daemon started, of all sessions [count].
struct RequestCounts {
  std::uint64_t reads = 0, changes = 0, stops = 0;  ///< that reached a method
  std::uint64_t refused = 0;                        ///< answered with an error
  std::uint64_t wrong_tokens = 0;
};

/// What all conversations of a server share; outlives them.
struct Shared {
  const rpc::Methods* methods = nullptr;
  Hub* hub = nullptr;
  access::IdempotencyCache* answered = nullptr;
  std::string epoch;  ///< of this start of the daemon
  /// Errors in one wording for all that is wrong with a token: nothing is learnt by trying.
  std::function<Result<TokenOwner>(std::string_view token)> token_owner;
  std::function<std::string()> readiness_json;
  /// The raw line "!halt", with spaces around it or none; from the Unix socket only, before
  /// anything else.
  std::function<void(const rpc::Caller&)> halt;
  std::function<Clock()> now;
  /// A file that may be fetched over HTTP, by "R-000318/dataset.h5": `callback` is called on the
  /// server's thread, at once or later. Errors: not_found; others, where it is not what it should
  /// be.
  using FileCallback = std::function<void(const Result<ServedFile>&)>;
  std::function<void(std::string_view path, const FileCallback& callback)> file = {};
  /// Whether what token_owner() told is so still. Left out: for ever.
  std::function<bool(const TokenOwner&)> is_token_valid = {};
  /// The raw line "!estop", likewise. Left out: it is refused.
  std::function<void(const rpc::Caller&)> emergency_stop = {};
  /// The body of GET /metrics: as OpenMetrics or as the older text format of Prometheus.
  std::function<std::string(bool is_open_metrics)> metrics_text = {};
  Sessions sessions = {};
  RequestCounts counts = {};
  /// Of those who do not come through the Unix socket.
  access::RateLimits rates = {};
  access::RefusedTokens refused_tokens = {};
  /// A token was refused to a client of this address, or to this user of the Unix socket.
  std::function<void(std::string_view from)> on_token_refused = {};
};

/// The first request of every client.
const rpc::MethodSpec& session_open();
/// Puts it into the table, so that rpc.discover tells of it and a second one is refused as such.
void add_session_open(rpc::Methods& methods);

/// "$/cancel": a call that waits for its answer is answered "request.cancelled" instead.
void add_cancel(rpc::Methods& methods);

class Session {
 public:
  /// Requests that may wait for their answers at a time [count].
  static constexpr std::size_t most_pending = 64;
  static constexpr std::size_t most_subscriptions = 64;
  /// A longer answer is refused, with what asks for less [bytes].
  static constexpr std::size_t most_answer_bytes = std::size_t{3} << 20;
  /// Wrong tokens on one connection; then it ends.
  static constexpr std::size_t most_wrong_tokens = 5;

  using Send = std::function<void(std::string line)>;
  Session(Shared& shared, Peer peer, std::string session, Send send);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Called once, when the peer has connected.
  void send_hello();
  /// One line without its end.
  void on_message(std::string_view line);
  /// What came after the last line when the peer had said all: a halt is heeded without its line's
  /// end, anything else is no line. True where it was one.
  bool on_unfinished_message(std::string_view rest);
  /// It has a place that is kept for halts: until that is another, all but what is urgent is
  /// refused.
  void restrict_to_emergency(bool so) { only_urgent_ = so; }
  /// Sends what subscriptions hold, as long as `has_space()` says so.
  void pump(const std::function<bool()>& has_space);

  /// Ends it, for a reason that the client is told once what is said already has been sent.
  void end(rpc::RpcError why) { ended_ = std::move(why); }
  /// Answers a call that waits with "request.cancelled"; what its method would still say is said to
  /// nobody. Errors: not_found; wrong_state of one that changes something, for it is done all the
  /// same.
  Status cancel(const std::string& id_json);
  /// Why nothing more is said or heard here: it was ended, or the token that the client came with
  /// is not good any more. What it asked for until then is done; nothing that it would be told is.
  [[nodiscard]] std::optional<rpc::RpcError> over() const;

  [[nodiscard]] const rpc::Caller& caller() const { return caller_; }
  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] std::size_t wrong_tokens() const { return wrong_tokens_; }
  /// For the methods of sub.*: this session's own. Used by the server's thread alone.
  using Subscriptions = std::map<std::string, std::shared_ptr<Subscription>, std::less<>>;
  Subscriptions& subscriptions() { return subscriptions_; }
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }

 private:
  void halt(std::string_view kind, const std::function<void(const rpc::Caller&)>& stop);
  void handle(const rpc::Request& request);
  /// The method, where it is a stop that this peer may ask for now.
  [[nodiscard]] const rpc::Methods::Entry* stop_named(const std::string& method) const;
  void stop(const rpc::Methods::Entry& entry, const rpc::Request& request,
            const rpc::RpcError* wrong);
  rpc::Outcome open_session(const nlohmann::json& params);
  rpc::RpcError wrong_token(const Error& why);
  /// Too many tokens were refused to its address of late. Never so of the Unix socket.
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
  bool opened_limited_ = false;  ///< while its address was limited
  std::size_t wrong_tokens_ = 0;
  std::optional<TokenOwner> owner_;  ///< of the token that it came with
  /// A request whose answer is not said yet. Who looks for its listener finds none when it has
  /// gone.
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
