#include "pade/live/web/web_server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <libwebsockets.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "pade/live/web/foxglove.hpp"
#include "pade/live/web/page.hpp"

namespace pade::live {
namespace {

constexpr std::size_t kMostClients = 8;
constexpr std::size_t kPiece = 64 * 1024;        // bytes that are given to the library at once
constexpr std::size_t kLongestRequest = 65'536;  // bytes of a message of a client
constexpr std::size_t kMostWaiting = 16;         // answers to a client that does not read them
constexpr int kKernelBuffer = 256 * 1024;        // bytes

/// A WebSocket.
struct WebClient {
  lws* socket = nullptr;
  std::deque<std::string> texts;                                         ///< that wait
  std::string request;                                                   ///< as far as it has come
  std::array<std::optional<std::uint32_t>, kWebChannels> subscriptions;  ///< ids, by channel
  Publisher::Cursor cursor;
  std::size_t turn = 0;  ///< channel whose turn is next
  /// @{
  /// What is being sent.
  std::shared_ptr<const std::string> bytes;
  std::array<std::uint8_t, kMessageHead> head{};
  std::size_t sent = 0;  ///< of head and bytes together
  /// @}

  [[nodiscard]] bool is_busy() const { return bytes != nullptr || !texts.empty(); }
  [[nodiscard]] bool wants_frames() const {
    for (std::size_t i = 0; i < kWebChannels; ++i)
      if (subscriptions[i] && web_channels[i].of_a_frame) return true;
    return false;
  }
};

/// What the library keeps of each connection for us.
struct Connection {
  WebClient* client;
  std::string* body;  ///< of an answer to a request that is no WebSocket, as far as it is not sent
};

std::string header_of(lws* socket, lws_token_indexes which) {
  std::string text(static_cast<std::size_t>(lws_hdr_total_length(socket, which)) + 1, '\0');
  const int length = lws_hdr_copy(socket, text.data(), static_cast<int>(text.size()), which);
  text.resize(static_cast<std::size_t>(std::max(0, length)));
  return text;
}

std::string token_of(lws* socket) {
  std::array<char, 512> text{};
  const char* const found =
      lws_get_urlarg_by_name(socket, "token=", text.data(), static_cast<int>(text.size()) - 1);
  return found == nullptr ? std::string() : std::string(found);
}

WebRequest request_of(lws* socket) {
  return {header_of(socket, WSI_TOKEN_HOST), header_of(socket, WSI_TOKEN_ORIGIN), token_of(socket),
          header_of(socket, WSI_TOKEN_PROTOCOL)};
}

}  // namespace

/// All but counts(), port() and wake() is of the server's thread.
class WebServer::Work {
 public:
  Work(const WebOptions& options, Publisher& publisher) : options_(options), publisher_(publisher) {}
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;
  ~Work();

  Status start();
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] const WebOptions& options() const { return options_; }
  [[nodiscard]] WebCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

  /// Called by the library; what it returns is what the library expects.
  int handle(lws* socket, lws_callback_reasons reason, Connection* connection, void* in, std::size_t length);

 private:
  static int callback(lws* socket, lws_callback_reasons reason, void* user, void* in, std::size_t length);
  void tick();
  void ask_all();
  int answer_request(lws* socket, Connection& connection, std::string_view path);
  static int answer(lws* socket, Connection& connection, int code, const char* type, std::string_view body);
  int send_body(lws* socket, Connection& connection);
  int refuse(lws* socket, const Refusal& refusal);
  void refused(const std::string& reason);
  int open(lws* socket, Connection& connection);
  void close(Connection& connection);
  int receive(WebClient& client, std::string_view part, bool last);
  static void obey(WebClient& client, const ClientRequest& request);
  int write(WebClient& client);
  bool take_next(WebClient& client);
  [[nodiscard]] std::size_t dropped_of(const WebClient& client) const;
  void look_around();

  struct Beat {
    lws_sorted_usec_list_t timer{};  // first: the library gives us its address
    Work* work = nullptr;
  };
  void beat();

  WebOptions options_;
  Publisher& publisher_;
  lws_context* context_ = nullptr;
  int port_ = 0;
  Beat beat_;
  std::list<WebClient> clients_;
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(LWS_PRE + kPiece);
  std::size_t dropped_by_gone_ = 0;  // of clients that have left
  mutable std::mutex mutex_;
  WebCounts counts_;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

WebServer::Work::~Work() {
  if (context_ == nullptr) return;
  publisher_.on_change({});
  over_ = true;
  lws_cancel_service(context_);
  if (thread_.joinable()) thread_.join();
  lws_context_destroy(context_);
}

Status WebServer::Work::start() {
  lws_set_log_level(LLL_ERR, [](int, const char* line) { (void)std::fputs(line, stderr); });
  static const std::array<lws_protocols, 4> kProtocols = {
      {{"http", callback, sizeof(Connection), 4096, 0, nullptr, 0},
       {kFoxgloveProtocols[0], callback, sizeof(Connection), 4096, 0, nullptr, 0},
       {kFoxgloveProtocols[1], callback, sizeof(Connection), 4096, 0, nullptr, 0},
       {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};
  lws_context_creation_info info{};
  info.port = options_.port;
  info.iface = options_.address == "0.0.0.0" ? nullptr : options_.address.c_str();
  info.protocols = kProtocols.data();
  info.user = this;
  info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  if (options_.address.find(':') == std::string::npos) info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  info.timeout_secs = 10;
  info.keepalive_timeout = 30;
  info.fd_limit_per_thread = 64;
  info.uid = static_cast<uid_t>(-1);
  info.gid = static_cast<gid_t>(-1);
  context_ = lws_create_context(&info);
  if (context_ == nullptr) return Error{"the web server could not be made"};
  lws_vhost* const host = lws_create_vhost(context_, &info);
  if (host == nullptr) {
    lws_context_destroy(std::exchange(context_, nullptr));
    return Error{fmt::format("web.port: cannot listen at {} port {}: is it taken by another program?",
                             options_.address, options_.port)};
  }
  port_ = lws_get_vhost_listen_port(host);
  publisher_.on_change([this] { lws_cancel_service(context_); });
  thread_ = std::thread([this] {
    constexpr int kBehind = 10;
    (void)::setpriority(PRIO_PROCESS, 0, kBehind);  // this thread's: the mapper goes first
    beat_.work = this;
    beat();
    while (!over_ && lws_service(context_, 0) >= 0) {
    }
  });
  return {};
}

int WebServer::Work::callback(lws* socket, lws_callback_reasons reason, void* user, void* in,
                              std::size_t length) {
  auto* const work = static_cast<Work*>(lws_context_user(lws_get_context(socket)));
  return work->handle(socket, reason, static_cast<Connection*>(user), in, length);
}

void WebServer::Work::beat() {
  constexpr lws_usec_t kPause = 250'000;  // µs
  lws_sul_schedule(
      context_, 0, &beat_.timer,
      [](lws_sorted_usec_list_t* timer) {
        Work* const work = reinterpret_cast<Beat*>(timer)->work;
        work->tick();
        work->beat();
      },
      kPause);
}

/// Counts and health, a few times a second.
void WebServer::Work::tick() {
  std::size_t dropped = dropped_by_gone_;
  for (const WebClient& client : clients_) dropped += dropped_of(client);
  WebCounts counts;
  {
    const std::lock_guard lock(mutex_);
    counts_.clients = clients_.size();
    counts_.dropped = dropped;
    counts = counts_;
  }
  publisher_.refresh(counts, !clients_.empty());
  ask_all();
}

std::size_t WebServer::Work::dropped_of(const WebClient& client) const {
  std::size_t dropped = client.cursor.dropped;
  for (std::size_t i = 0; i < kWebChannels; ++i)
    if (client.subscriptions[i]) dropped += publisher_.missed(static_cast<WebChannel>(i), client.cursor);
  return dropped;
}

/// Each client that has nothing to send is asked anew.
void WebServer::Work::ask_all() {
  for (WebClient& client : clients_)
    if (client.bytes == nullptr) lws_callback_on_writable(client.socket);
}

void WebServer::Work::look_around() {
  publisher_.set_hungry(std::any_of(clients_.begin(), clients_.end(), [](const WebClient& client) {
    return !client.is_busy() && client.wants_frames();
  }));
}

void WebServer::Work::refused(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  ++counts_.refused;
  counts_.last_refusal = reason;
}

int WebServer::Work::refuse(lws* socket, const Refusal& refusal) {
  refused(refusal.reason);
  // It comes from the network, and goes into a page.
  std::string text = refusal.reason;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '<' || c == '>' || c == '&' || c < ' ' || c > '~'; },
      '?');
  (void)lws_return_http_status(socket, static_cast<unsigned>(refusal.code), text.c_str());
  return 1;
}

int WebServer::Work::answer(lws* socket, Connection& connection, int code, const char* type,
                            std::string_view body) {
  std::array<std::uint8_t, LWS_PRE + 1024> head{};
  std::uint8_t* const start = head.data() + LWS_PRE;
  std::uint8_t* at = start;
  std::uint8_t* const end = head.data() + head.size() - 1;
  const auto add = [&](const char* name, std::string_view value) {
    return lws_add_http_header_by_name(socket, reinterpret_cast<const std::uint8_t*>(name),
                                       reinterpret_cast<const std::uint8_t*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  const bool made =
      lws_add_http_common_headers(socket, static_cast<unsigned>(code), type, body.size(), &at, end) == 0 &&
      add("cache-control:", "no-store") && add("x-content-type-options:", "nosniff") &&
      add("content-security-policy:",
          "default-src 'self'; img-src blob:; style-src 'unsafe-inline'; "
          "connect-src 'self' ws:; frame-ancestors 'none'") &&
      add("referrer-policy:", "no-referrer");
  if (!made || lws_finalize_write_http_header(socket, start, &at, end) != 0) return 1;
  connection.body = new std::string(body);
  lws_callback_on_writable(socket);
  return 0;
}

int WebServer::Work::send_body(lws* socket, Connection& connection) {
  if (connection.body == nullptr) return 0;
  const std::size_t count = std::min(connection.body->size(), kPiece);
  std::copy_n(connection.body->data(), count, buffer_.data() + LWS_PRE);
  const bool last = count == connection.body->size();
  connection.body->erase(0, count);
  const int written =
      lws_write(socket, buffer_.data() + LWS_PRE, count, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP);
  if (written < static_cast<int>(count)) return -1;
  if (!last) {
    lws_callback_on_writable(socket);
    return 0;
  }
  delete std::exchange(connection.body, nullptr);
  return lws_http_transaction_completed(socket) != 0 ? -1 : 0;
}

int WebServer::Work::answer_request(lws* socket, Connection& connection, std::string_view path) {
  const bool is_script = path == "/page.js" || path == "/view_3d.js";  // nothing of the flight is in them
  if (!is_script) {
    if (const Refusal refusal = refusal_of_request(request_of(socket), options_); refusal.code != 0) {
      refused(refusal.reason);
      return answer(socket, connection, refusal.code, "text/plain", refusal.reason + "\n");
    }
  }
  if (path == "/") return answer(socket, connection, 200, "text/html; charset=utf-8", page_html());
  if (path == "/page.js") return answer(socket, connection, 200, "text/javascript", page_script());
  if (path == "/view_3d.js") return answer(socket, connection, 200, "text/javascript", page_view_3d());
  if (path == "/health.json")
    return answer(socket, connection, 200, "application/json", json_of(publisher_.health()));
  return answer(socket, connection, 404, "text/plain", "there is no such thing here\n");
}

int WebServer::Work::open(lws* socket, Connection& connection) {
  const int buffer = kKernelBuffer;
  (void)::setsockopt(lws_get_socket_fd(socket), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof(buffer));
  WebClient& client = clients_.emplace_back();
  client.socket = socket;
  client.texts = {server_info(), advertisement()};
  connection.client = &client;
  {
    const std::lock_guard lock(mutex_);
    ++counts_.come;
    counts_.clients = clients_.size();
  }
  lws_callback_on_writable(socket);
  return 0;
}

void WebServer::Work::close(Connection& connection) {
  const WebClient* const client = std::exchange(connection.client, nullptr);
  if (client == nullptr) return;
  dropped_by_gone_ += dropped_of(*client);
  clients_.remove_if([&](const WebClient& other) { return &other == client; });
  look_around();
}

void WebServer::Work::obey(WebClient& client, const ClientRequest& request) {
  for (const std::uint32_t id : request.unsubscribe)
    for (auto& subscription : client.subscriptions)
      if (subscription == id) subscription.reset();
  for (const auto& wanted : request.subscribe) {
    const auto i = static_cast<std::size_t>(wanted.channel);
    client.subscriptions[i] = wanted.id;
    client.cursor.sent[i] = 0;  // all of it
  }
}

int WebServer::Work::receive(WebClient& client, std::string_view part, bool last) {
  if (client.request.size() + part.size() > kLongestRequest) {
    refused("a request of more than 64 kB");
    return -1;
  }
  client.request += part;
  if (!last) return 0;
  const auto request = read_client_request(std::exchange(client.request, {}));
  if (request) {
    obey(client, *request);
  } else if (client.texts.size() < kMostWaiting) {
    client.texts.push_back(complaint(request.error().message));
  } else {
    refused("a client that asks for what is not there and does not read the answers");
    return -1;
  }
  look_around();
  lws_callback_on_writable(client.socket);
  return 0;
}

/// The next message of those subscribed to, each channel in its turn; false if there is none.
bool WebServer::Work::take_next(WebClient& client) {
  for (std::size_t tried = 0; tried < kWebChannels; ++tried) {
    const std::size_t i = client.turn;
    client.turn = (client.turn + 1) % kWebChannels;
    if (!client.subscriptions[i]) continue;
    auto message = publisher_.next(static_cast<WebChannel>(i), client.cursor);
    if (!message) continue;
    client.head = message_head(*client.subscriptions[i], message->time);
    client.bytes = std::move(message->bytes);
    client.sent = 0;
    return true;
  }
  return false;
}

/// One piece; the rest when the socket takes more.
int WebServer::Work::write(WebClient& client) {
  std::uint8_t* const to = buffer_.data() + LWS_PRE;
  if (client.bytes == nullptr && !client.texts.empty()) {
    const std::string text = std::move(client.texts.front());
    client.texts.pop_front();
    std::vector<std::uint8_t> bytes(LWS_PRE + text.size());
    std::copy(text.begin(), text.end(), bytes.begin() + LWS_PRE);
    if (lws_write(client.socket, bytes.data() + LWS_PRE, text.size(), LWS_WRITE_TEXT) < 0) return -1;
    lws_callback_on_writable(client.socket);
    return 0;
  }
  if (client.bytes == nullptr && !take_next(client)) {
    look_around();
    return 0;
  }
  const bool first = client.sent == 0;
  std::size_t count = 0;
  if (first) {
    std::copy(client.head.begin(), client.head.end(), to);
    count = kMessageHead;
  }
  const std::size_t from = first ? 0 : client.sent - kMessageHead;
  const std::size_t more = std::min(client.bytes->size() - from, kPiece - count);
  std::copy_n(client.bytes->data() + from, more, to + count);
  count += more;
  client.sent += count;
  const bool last = client.sent == kMessageHead + client.bytes->size();
  const int kind = (first ? LWS_WRITE_BINARY : LWS_WRITE_CONTINUATION) | (last ? 0 : LWS_WRITE_NO_FIN);
  if (lws_write(client.socket, to, count, static_cast<lws_write_protocol>(kind)) < 0) return -1;
  if (last) client.bytes.reset();
  lws_callback_on_writable(client.socket);
  look_around();
  return 0;
}

int WebServer::Work::handle(lws* socket, lws_callback_reasons reason, Connection* connection, void* in,
                            std::size_t length) {
  switch (reason) {
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      ask_all();
      return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE: {
      if (std::strcmp(static_cast<const char*>(in), "websocket") != 0)
        return refuse(socket, {400, "an upgrade to something else than a WebSocket"});
      Refusal refusal = refusal_of_upgrade(request_of(socket), options_);
      if (refusal.code == 0 && clients_.size() >= kMostClients)
        refusal = {503, fmt::format("{} clients already", kMostClients)};
      return refusal.code == 0 ? 0 : refuse(socket, refusal);
    }
    case LWS_CALLBACK_HTTP:
      return answer_request(socket, *connection, {static_cast<const char*>(in), length});
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return send_body(socket, *connection);
    case LWS_CALLBACK_HTTP_FILE_COMPLETION:
      return lws_http_transaction_completed(socket) != 0 ? -1 : 0;
    case LWS_CALLBACK_CLOSED_HTTP:
      if (connection != nullptr) delete std::exchange(connection->body, nullptr);
      return 0;
    case LWS_CALLBACK_ESTABLISHED:
      return open(socket, *connection);
    case LWS_CALLBACK_CLOSED:
      close(*connection);
      return 0;
    case LWS_CALLBACK_RECEIVE:
      return receive(*connection->client, {static_cast<const char*>(in), length},
                     lws_is_final_fragment(socket) != 0);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return write(*connection->client);
    default:
      return lws_callback_http_dummy(socket, reason, connection, in, length);
  }
}

WebServer::WebServer(std::unique_ptr<Work> work) : work_(std::move(work)) {}
WebServer::~WebServer() = default;

Result<std::unique_ptr<WebServer>> WebServer::start(const WebOptions& options, Publisher& publisher) {
  auto work = std::make_unique<Work>(options, publisher);
  if (const Status started = work->start(); !started) return started.error();
  return std::unique_ptr<WebServer>(new WebServer(std::move(work)));
}

int WebServer::port() const { return work_->port(); }

std::string WebServer::url() const {
  const WebOptions& options = work_->options();
  const bool six = options.address.find(':') != std::string::npos;
  return fmt::format("http://{}{}{}:{}/", six ? "[" : "", options.address, six ? "]" : "", port());
}

WebCounts WebServer::counts() const { return work_->counts(); }

}  // namespace pade::live
