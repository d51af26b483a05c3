#include "daemon/server/http_server.hpp"

#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

namespace weft::daemon::server {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr std::size_t most_lines_waiting = 64;  // of a stream; more stay with its subscription

/// What a conversation says, from the daemon's thread to a client's.
class Mailbox {
 public:
  void put(std::string line) {
    {
      const std::scoped_lock lock(mutex_);
      lines_.push_back(std::move(line));
    }
    news_.notify_one();
  }
  /// The next line; nothing when there is none in time.
  std::optional<std::string> take(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    if (!news_.wait_for(lock, patience, [this] { return !lines_.empty(); })) return std::nullopt;
    std::string line = std::move(lines_.front());
    lines_.pop_front();
    return line;
  }
  bool has_room() {
    const std::scoped_lock lock(mutex_);
    return lines_.size() < most_lines_waiting;
  }

 private:
  std::mutex mutex_;
  std::condition_variable news_;
  std::deque<std::string> lines_;
};

/// One HTTP request's conversation. The conversation is the daemon's thread's alone.
struct Exchange {
  Mailbox mailbox;
  std::unique_ptr<Conversation> conversation;
};

std::string bearer_of(const httplib::Request& request) {
  constexpr std::string_view scheme = "Bearer ";
  const std::string header = request.get_header_value("Authorization");
  return header.starts_with(scheme) ? header.substr(scheme.size()) : std::string();
}

/// A page of elsewhere whose name was made to mean 127.0.0.1 has its own name as Host.
bool meant_for_us(const httplib::Request& request) {
  std::string host = request.get_header_value("Host");
  host = host.substr(0, host.find(':'));
  return host == "127.0.0.1" || host == "localhost";
}

std::string open_line(const std::string& token) {
  return json{{"jsonrpc", "2.0"},
              {"id", "open"},
              {"method", "session.open"},
              {"params", {{"client", "http"}, {"token", token}}}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

std::vector<std::string> topics_of(const httplib::Request& request) {
  if (!request.has_param("topics")) return {"run:*", "rig", "lease:*"};
  std::vector<std::string> out;
  std::istringstream text(request.get_param_value("topics"));
  for (std::string topic; std::getline(text, topic, ',');) out.push_back(topic);
  return out;
}

/// The request that begins the stream: what the query says, or what a browser that was cut off saw
/// last ("EPOCH-SEQ"), where this daemon still has what came after.
std::string subscribe_line(const httplib::Request& request, const std::string& epoch) {
  json params{{"topics", topics_of(request)}, {"mode", "latest"}};
  if (request.has_param("mode")) params["mode"] = request.get_param_value("mode");
  const std::string rate = request.get_param_value("max_hz");
  if (!rate.empty()) params["max_hz"] = json::parse(rate, nullptr, false);
  const std::string last = request.get_header_value("Last-Event-ID");
  if (last.starts_with(epoch + "-"))
    params["from_seq"] = json::parse(last.substr(epoch.size() + 1), nullptr, false);
  return json{{"jsonrpc", "2.0"}, {"id", "sub"}, {"method", "sub.open"}, {"params", params}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

bool is_error(const std::string& line) {
  const json answer = json::parse(line, nullptr, false);
  return !answer.is_object() || answer.contains("error");
}

/// A conversation's line as an event of the stream.
std::string event_of(const std::string& line, const std::string& epoch) {
  const json message = json::parse(line, nullptr, false);
  if (!message.is_object()) return {};
  const bool snapshot = message.contains("result");
  const json& body = snapshot ? message.at("result") : message.at("params");
  return "id: " + epoch + "-" + body.at("seq").dump() +
         "\nevent: " + (snapshot ? "snapshot" : "event") + "\ndata: " + body.dump() + "\n\n";
}

void say(httplib::Response& response, int status, const std::string& line) {
  response.status = status;
  response.set_content(line + "\n", "application/json");
}

std::string refusal_line(std::string_view kind, Error error) {
  return rpc::error_line("null", rpc::rpc_error(rpc::code::access, kind, std::move(error)));
}

}  // namespace

struct HttpServer::Parts {
  using Post = std::function<void(std::function<void()>)>;

  Parts(Shared& all, Post to_daemon, const HttpLimits& at_most)
      : shared(&all), post(std::move(to_daemon)), limits(at_most) {}

  std::shared_ptr<Exchange> begin(const httplib::Request& request, bool stays);
  void end(const std::shared_ptr<Exchange>& exchange);
  std::optional<std::string> answer(const std::shared_ptr<Exchange>& exchange);
  bool admit(const httplib::Request& request, httplib::Response& response);
  void rpc(const httplib::Request& request, httplib::Response& response);
  void events(const httplib::Request& request, httplib::Response& response);
  bool stream(const std::shared_ptr<Exchange>& exchange, httplib::DataSink& sink);
  void routes();

  Shared* shared;
  Post post;
  HttpLimits limits;
  httplib::Server server;
  std::thread listener;
  std::uint16_t port = 0;
  std::atomic<bool> stopping = false;
  std::atomic<std::size_t> streams = 0;
  std::atomic<std::uint64_t> next_session = 1;
  std::list<std::weak_ptr<Exchange>> staying;  // the daemon's thread's alone
};

/// A conversation that has been told the token; its answer to that is the first to come.
std::shared_ptr<Exchange> HttpServer::Parts::begin(const httplib::Request& request, bool stays) {
  auto exchange = std::make_shared<Exchange>();
  const std::string session = "h-" + std::to_string(next_session++);
  post([this, exchange, session, stays, opening = open_line(bearer_of(request))] {
    // The conversation is the exchange's own: it does not keep it alive.
    exchange->conversation =
        std::make_unique<Conversation>(*shared, Peer{false, {}, std::nullopt, stays}, session,
                                       [to = std::weak_ptr(exchange)](std::string line) {
                                         if (const auto alive = to.lock())
                                           alive->mailbox.put(std::move(line));
                                       });
    if (stays) staying.push_back(exchange);
    exchange->conversation->hear(opening);
  });
  return exchange;
}

void HttpServer::Parts::end(const std::shared_ptr<Exchange>& exchange) {
  post([exchange] { exchange->conversation.reset(); });
}

std::optional<std::string> HttpServer::Parts::answer(const std::shared_ptr<Exchange>& exchange) {
  const auto until = shared->now() + limits.answer;
  while (!stopping && shared->now() < until)
    if (auto line = exchange->mailbox.take(100ms)) return line;
  return std::nullopt;
}

bool HttpServer::Parts::admit(const httplib::Request& request, httplib::Response& response) {
  if (meant_for_us(request)) return true;
  say(response, 403,
      refusal_line("access.host", {Errc::wrong_state,
                                   "this daemon has no such name",
                                   "Host",
                                   "127.0.0.1 or localhost",
                                   request.get_header_value("Host"),
                                   {}}));
  return false;
}

void HttpServer::Parts::rpc(const httplib::Request& request, httplib::Response& response) {
  if (!admit(request, response)) return;
  // Other pages' forms can send text, but not this type.
  if (!request.get_header_value("Content-Type").starts_with("application/json"))
    return say(response, 415,
               refusal_line("request.type", {Errc::invalid_argument,
                                             "another content type",
                                             "Content-Type",
                                             "application/json",
                                             request.get_header_value("Content-Type"),
                                             {}}));
  const auto parsed = rpc::parse_request(request.body);
  if (!parsed)
    return say(response, 400, rpc::error_line(parsed.error().id_json, parsed.error().error));
  const auto exchange = begin(request, false);
  const auto opened = answer(exchange);
  if (!opened)
    return say(
        response, 503,
        refusal_line("daemon.stops", {Errc::wrong_state, "the daemon stops", {}, {}, {}, {}}));
  if (is_error(*opened)) {
    end(exchange);
    return say(response, 401, *opened);
  }
  post([exchange, line = request.body] { exchange->conversation->hear(line); });
  if (!parsed->id_json) {
    end(exchange);
    response.status = 204;
    return;
  }
  const auto said = answer(exchange);
  end(exchange);
  if (said) return say(response, 200, *said);
  say(response, 504,
      refusal_line("request.no_answer", {Errc::timeout,
                                         "no answer in time",
                                         {},
                                         std::to_string(limits.answer.count()) + " s",
                                         {},
                                         {}}));
}

void HttpServer::Parts::events(const httplib::Request& request, httplib::Response& response) {
  if (!admit(request, response)) return;
  if (streams++ >= limits.streams) {
    --streams;
    return say(response, 503,
               refusal_line("request.too_many",
                            {Errc::wrong_state,
                             "too many streams of events",
                             {},
                             "at most " + std::to_string(limits.streams),
                             {},
                             "Close one, or use the socket, which has no such bound"}));
  }
  const auto exchange = begin(request, true);
  const auto leave = [this, exchange] {
    end(exchange);
    --streams;
  };
  const auto opened = answer(exchange);
  if (!opened || is_error(*opened)) {
    say(response, 401, opened.value_or("null"));
    return leave();
  }
  const auto ask = [&](const std::string& line) {
    post([exchange, line] { exchange->conversation->hear(line); });
    return answer(exchange);
  };
  auto first = ask(subscribe_line(request, shared->epoch));
  if (first && is_error(*first) && request.has_header("Last-Event-ID")) {
    httplib::Request fresh = request;
    fresh.headers.erase("Last-Event-ID");  // too long ago: a snapshot instead
    first = ask(subscribe_line(fresh, shared->epoch));
  }
  if (!first || is_error(*first)) {
    say(response, 400, first.value_or("null"));
    return leave();
  }
  exchange->mailbox.put(*first);
  response.set_header("Cache-Control", "no-store");
  response.set_chunked_content_provider(
      "text/event-stream",
      [this, exchange](std::size_t, httplib::DataSink& sink) { return stream(exchange, sink); },
      [leave](bool) { leave(); });
}

/// One event, or a comment that shows whether the client is still there.
bool HttpServer::Parts::stream(const std::shared_ptr<Exchange>& exchange, httplib::DataSink& sink) {
  const auto until = shared->now() + limits.heartbeat;
  while (!stopping) {
    if (const auto line = exchange->mailbox.take(100ms)) {
      const std::string event = event_of(*line, shared->epoch);
      return sink.write(event.data(), event.size());
    }
    if (shared->now() < until) continue;
    constexpr std::string_view comment = ":\n\n";
    return sink.write(comment.data(), comment.size());
  }
  sink.done();
  return false;
}

void HttpServer::Parts::routes() {
  server.new_task_queue = [this] { return new httplib::ThreadPool(limits.requests); };
  server.set_payload_max_length(rpc::most_line_bytes);
  server.set_read_timeout(limits.silence);
  server.set_write_timeout(limits.silence);
  server.set_keep_alive_timeout(limits.silence.count());
  server.set_tcp_nodelay(true);
  server.Post("/rpc", [this](const auto& request, auto& response) { rpc(request, response); });
  server.Get("/events", [this](const auto& request, auto& response) { events(request, response); });
}

HttpServer::HttpServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

HttpServer::~HttpServer() {
  parts_->stopping = true;
  parts_->server.stop();
  if (parts_->listener.joinable()) parts_->listener.join();
}

Result<std::unique_ptr<HttpServer>> HttpServer::open(
    std::uint16_t port, Shared& shared, std::function<void(std::function<void()>)> post,
    const HttpLimits& limits) {
  auto parts = std::make_unique<Parts>(shared, std::move(post), limits);
  parts->routes();
  constexpr const char* host = "127.0.0.1";
  const int got = port == 0 ? parts->server.bind_to_any_port(host)
                            : (parts->server.bind_to_port(host, port) ? int{port} : -1);
  if (got < 0)
    return fail(Errc::io, "cannot listen for HTTP", "127.0.0.1:" + std::to_string(port), {}, {},
                "Another program may hold the port");
  parts->port = static_cast<std::uint16_t>(got);
  parts->listener = std::thread([&server = parts->server] { server.listen_after_bind(); });
  while (!parts->server.is_running()) std::this_thread::yield();  // stop() before that is not heard
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(parts)));
}

void HttpServer::pump() {
  for (auto it = parts_->staying.begin(); it != parts_->staying.end();) {
    const auto exchange = it->lock();
    if (exchange && exchange->conversation)
      exchange->conversation->pump([&] { return exchange->mailbox.has_room(); });
    it = exchange && exchange->conversation ? std::next(it) : parts_->staying.erase(it);
  }
}

std::uint16_t HttpServer::port() const {
  return parts_->port;
}

}  // namespace weft::daemon::server
