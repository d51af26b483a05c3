#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::api {
namespace {

constexpr auto most_credit = static_cast<std::int64_t>(server::Subscription::most_credit);

Result<server::SubscriptionRequest> read_subscription_request(const Call& call) {
  constexpr std::size_t most_topics = 64;
  const json& params = call.params;
  server::SubscriptionRequest request;
  const json& topics = params.at("topics");
  if (topics.empty() || topics.size() > most_topics)
    return fail({.code = Errc::range,
                 .where = "/params/topics",
                 .what = "number of topics out of range",
                 .expected = "1 to 64",
                 .got = std::to_string(topics.size())});
  for (const json& topic : topics) {
    if (!topic.is_string())
      return pass(bad_param("topics", "invalid topic", "string", topic.type_name()));
    request.topics.push_back(topic.get<std::string>());
    if (request.topics.back().size() > rpc::longest_text)
      return fail({.code = Errc::range,
                   .where = "/params/topics",
                   .what = "topic name too long",
                   .expected = "at most " + std::to_string(rpc::longest_text) + " bytes",
                   .got = std::to_string(request.topics.back().size()) + " bytes"});
  }
  const std::string mode = params.value("mode", "latest");
  if (mode != "latest" && mode != "every")
    return pass(bad_param("mode", "unknown mode", "latest or every", mode));
  request.mode = mode == "every" ? server::Mode::every : server::Mode::latest;
  request.max_hz = params.value("max_hz", request.max_hz);
  constexpr double slowest_hz = 1e-3;
  if (request.max_hz != 0 && !(request.max_hz >= slowest_hz && request.max_hz <= 1000))
    return fail({.code = Errc::range,
                 .where = "/params/max_hz",
                 .what = "rate out of range",
                 .expected = "0 or 0.001 to 1000 Hz",
                 .got = std::to_string(request.max_hz)});
  if (params.contains("credit")) {
    const auto credit =
        read_whole_number(call, {"credit", 0, 0, most_credit, "number of events out of range"});
    if (!credit) return pass(credit.error());
    request.credit = *credit;
  }
  return request;
}

tl::expected<server::Opened, rpc::RpcError> opened(const Services& services, const Call& call,
                                                   const server::SubscriptionRequest& request) {
  if (!call.params.contains("from_seq")) return services.hub->open(request);
  const std::string epoch = call.params.value("epoch", services.epoch);
  const auto from = call.params.at("from_seq").get<std::int64_t>();
  if (epoch != services.epoch || from < 0)
    return refused(rpc::code::state + 40, "replay.gone",
                   {.code = Errc::range,
                    .where = "/params/epoch",
                    .what = "events from before a restart of the daemon",
                    .expected = services.epoch,
                    .got = epoch,
                    .hint = "Omit from_seq to get a snapshot"},
                   true);
  return services.hub->replay(request, static_cast<std::uint64_t>(from));
}

Outcome open_subscription(const Services& services, const Call& call) {
  if (call.client_session == nullptr)
    return refused({.code = Errc::unsupported,
                    .what = "events not available over POST /rpc",
                    .hint = "Use the socket, or GET /events"});
  if (call.client_session->subscriptions().size() >= server::Session::most_subscriptions)
    return refused({.code = Errc::range,
                    .what = "too many subscriptions",
                    .expected = "at most " + std::to_string(server::Session::most_subscriptions),
                    .hint = "Close unneeded subscriptions with sub.close"});
  const auto request = read_subscription_request(call);
  if (!request) return refused(request.error());
  const auto made = opened(services, call, *request);
  if (!made) return tl::unexpected(made.error());
  call.client_session->subscriptions().emplace(made->subscription->id(), made->subscription);
  return R"({"sub":")" + made->subscription->id() + R"(","seq":)" + std::to_string(made->seq) +
         R"(,"left_off":)" + std::to_string(made->left_off) + R"(,"snapshot":)" +
         made->snapshot_json + "}";
}

tl::unexpected<rpc::RpcError> no_subscription(const std::string& id) {
  return refused(
      {.code = Errc::not_found, .where = "/params/sub", .what = "unknown subscription", .got = id});
}

Outcome grant_credit(const Services&, const Call& call) {
  const std::string id = call.params.at("sub").get<std::string>();
  if (call.client_session == nullptr) return no_subscription(id);
  const auto mine = call.client_session->subscriptions().find(id);
  if (mine == call.client_session->subscriptions().end()) return no_subscription(id);
  const auto events =
      read_whole_number(call, {"events", 0, 1, most_credit, "number of events out of range"});
  if (!events) return refused(events.error());
  if (const Status ok = mine->second->grant(*events); !ok) return refused(ok.error());
  return format_text({{"sub", id}, {"credit", *mine->second->credit()}});
}

Outcome close_subscription(const Services&, const Call& call) {
  const std::string id = call.params.at("sub").get<std::string>();
  if (call.client_session == nullptr || call.client_session->subscriptions().erase(id) == 0)
    return no_subscription(id);
  return format_text({{"closed", id}});
}

}  // namespace

void add_subscription_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read(
      "sub.open", "subscribe to events: a snapshot first, then the changes",
      {{"topics", ParamType::list, true, "topics, \"run:R-000318\"; \"run:*\" for all of a kind"},
       {"mode", ParamType::text, false,
        "delivery (default: latest; latest: merged events, every: all events, gaps are reported)"},
       {"max_hz", ParamType::number, false, "largest rate of mode latest [Hz] (default: 20)"},
       {"credit", ParamType::integer, false,
        "number of events to send before sub.credit grants more (default: unlimited); events "
        "dropped meanwhile are reported as a gap"},
       {"from_seq", ParamType::integer, false,
        "send all events after this number instead of a snapshot"},
       {"epoch", ParamType::text, false, "epoch of the daemon that numbered from_seq"}},
      "sub, seq, snapshot (by topic, at most 1 MiB), left_off (number of topics that did not fit, "
      "those that changed longest ago; request them by name, or with run.list)",
      open_subscription);
  group.read("sub.credit", "grant more events to a subscription opened with credit",
             {{"sub", ParamType::text, true, "id of the subscription, \"u3\""},
              {"events", ParamType::integer, true, "number of further events, 1 to 1000000"}},
             "sub, credit", grant_credit);
  group.read("sub.close", "close a subscription",
             {{"sub", ParamType::text, true, "id of the subscription, \"u3\""}}, "closed",
             close_subscription);
}

}  // namespace weft::daemon::api
