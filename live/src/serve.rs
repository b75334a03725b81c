//! The page and its WebSocket.

use crate::access::{Access, Role};
use crate::error::LiveError;
use crate::page;
use axum::extract::ws::{Message as Frame, WebSocket, WebSocketUpgrade};
use axum::extract::{ConnectInfo, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Router, serve};
use backdrive_nodes::transport::ros2::Key;
use nix::libc;
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::{broadcast, watch};

/// Longest message of a viewer, bytes.
const MOST_BYTES: usize = 8192;

/// How long what is said last may take, at most: a viewer on a busy machine is given time to hear it.
const LAST_WORDS: Duration = Duration::from_secs(3);

/// The answer to a viewer.
pub(crate) enum Reply {
    Words(Value),
    Frame(Frame),
}

/// What the page is a window on.
pub(crate) trait Desk: Send + Sync + 'static {
    /// A new viewer: the past, and what comes.
    fn join(&self) -> (Vec<Frame>, broadcast::Receiver<Frame>);

    /// What a viewer asks. It may take long.
    fn answer(&self, asked: &Value, role: Role, by: &str) -> Reply;

    /// Somebody was refused.
    fn refused(&self, by: &str, why: &str);
}

/// A server that runs in a thread of its own.
pub(crate) struct Server {
    address: SocketAddr,
    access: Access,
    over: watch::Sender<bool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

#[derive(Clone)]
struct Served {
    desk: Arc<dyn Desk>,
    access: Access,
    over: watch::Receiver<bool>,
    viewers: Arc<AtomicUsize>,
}

/// Counts a viewer while it is connected.
struct Present(Arc<AtomicUsize>);

impl Present {
    fn new(viewers: &Arc<AtomicUsize>) -> Present {
        viewers.fetch_add(1, Ordering::SeqCst);
        Present(Arc::clone(viewers))
    }
}

impl Drop for Present {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Priority of everything of the window, and of who looks for a cause: below that of every node, and above work that has no hurry.
pub(crate) const NICE: i32 = 5;

/// Everything of the window yields to the loop.
pub(crate) fn yield_to_others() {
    // SAFETY: a plain call; on Linux 0 is the calling thread. Where it is refused the thread keeps its priority.
    let _ = unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICE) };
}

impl Server {
    /// Listens at an address; port 0 for one that is free.
    ///
    /// # Errors
    /// The address cannot be had, or the machine has no random numbers.
    pub fn start(desk: Arc<dyn Desk>, address: SocketAddr) -> Result<Server, LiveError> {
        let wrong =
            |e: std::io::Error| LiveError::machine(format!("cannot listen at {address}: {e}; name another address, or port 0 for any"));
        let listener = std::net::TcpListener::bind(address).map_err(wrong)?;
        listener.set_nonblocking(true).map_err(wrong)?;
        let address = listener.local_addr().map_err(wrong)?;
        let token = || Key::fresh().map(|key| key.to_hex()[..32].to_string()).map_err(LiveError::machine);
        let access = Access { control: token()?, watch: token()?, port: address.port() };
        let (over, ends) = watch::channel(false);
        let served = Served { desk, access: access.clone(), over: ends, viewers: Arc::default() };
        let thread = std::thread::Builder::new().name("live-server".to_string()).spawn(move || {
            yield_to_others();
            if let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() {
                runtime.block_on(listen(listener, served));
            }
        });
        Ok(Server { address, access, over, thread: Some(thread.map_err(LiveError::machine)?) })
    }

    /// The address of the page with the right to change something, and of one with the right to look only.
    pub fn urls(&self) -> [String; 2] {
        // A browser on this machine reaches a server that listens everywhere at the loopback address.
        let host = if self.address.ip().is_unspecified() { "127.0.0.1".to_string() } else { self.address.ip().to_string() };
        let host = if host.contains(':') { format!("[{host}]") } else { host };
        [&self.access.control, &self.access.watch].map(|token| format!("http://{host}:{}/?token={token}", self.address.port()))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.over.send(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

async fn listen(listener: std::net::TcpListener, served: Served) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let (mut over, viewers) = (served.over.clone(), Arc::clone(&served.viewers));
    let router = Router::new().route("/", get(show)).route("/ws", get(talk)).with_state(served);
    let service = router.into_make_service_with_connect_info::<SocketAddr>();
    tokio::select! {
        _ = async { serve(listener, service).await } => {}
        () = async { let _ = over.wait_for(|over| *over).await; } => {
            let until = tokio::time::Instant::now() + LAST_WORDS;
            while viewers.load(Ordering::SeqCst) > 0 && tokio::time::Instant::now() < until {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        }
    }
}

fn word(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

fn token(uri: &Uri) -> Option<&str> {
    uri.query()?.split('&').find_map(|pair| pair.strip_prefix("token="))
}

fn admitted(served: &Served, from: SocketAddr, headers: &HeaderMap, uri: &Uri) -> Result<Role, Box<Response>> {
    let checked = served.access.check(word(headers, header::HOST), word(headers, header::ORIGIN), token(uri));
    checked.map_err(|why| {
        let (desk, by) = (Arc::clone(&served.desk), format!("page {from}"));
        tokio::task::spawn_blocking(move || desk.refused(&by, why));
        (StatusCode::FORBIDDEN, format!("refused: {why}. Open the address that `backdrive` printed.\n")).into_response().into()
    })
}

async fn show(State(served): State<Served>, ConnectInfo(from): ConnectInfo<SocketAddr>, headers: HeaderMap, uri: Uri) -> Response {
    if let Err(refusal) = admitted(&served, from, &headers, &uri) {
        return *refusal;
    }
    let Ok(nonce) = Key::fresh().map(|key| key.to_hex()[..32].to_string()) else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8".to_string()),
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::REFERRER_POLICY, "no-referrer".to_string()),
        (header::CACHE_CONTROL, "no-store".to_string()),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff".to_string()),
    ];
    (headers, page::html(&nonce)).into_response()
}

async fn talk(
    State(served): State<Served>,
    ConnectInfo(from): ConnectInfo<SocketAddr>,
    headers: HeaderMap,
    uri: Uri,
    upgrade: WebSocketUpgrade,
) -> Response {
    match admitted(&served, from, &headers, &uri) {
        Err(refusal) => *refusal,
        Ok(role) => upgrade.max_message_size(MOST_BYTES).on_upgrade(move |socket| attend(socket, served, role, from)),
    }
}

/// Serves one viewer to the end.
async fn attend(mut socket: WebSocket, served: Served, role: Role, from: SocketAddr) {
    let (by, _present) = (format!("page {from}"), Present::new(&served.viewers));
    let (past, mut news) = served.desk.join();
    let mut over = served.over.clone();
    let first = json!({ "type": "role", "control": role == Role::Control });
    for frame in std::iter::once(crate::hub::text(&first)).chain(past) {
        if socket.send(frame).await.is_err() {
            return;
        }
    }
    let mut ending = false;
    loop {
        let next = tokio::select! {
            biased;
            asked = socket.recv(), if !ending => match asked {
                Some(Ok(Frame::Text(words))) => match reply(&served, &words, role, &by).await {
                    Some(frame) => Ok(frame),
                    None => continue,
                },
                Some(Ok(Frame::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
            frame = news.recv() => match frame {
                Ok(frame) => Ok(frame),
                // A slow viewer: what it missed is gone for it, and it is told.
                Err(broadcast::error::RecvError::Lagged(frames)) => Ok(crate::hub::text(&json!({ "type": "lagged", "frames": frames }))),
                Err(broadcast::error::RecvError::Closed) => Err(()),
            },
            () = async { let _ = over.wait_for(|over| *over).await; }, if !ending => {
                ending = true;
                continue;
            }
            () = tokio::time::sleep(Duration::from_millis(50)), if ending => Err(()),
        };
        match next {
            Ok(frame) => {
                if socket.send(frame).await.is_err() {
                    return;
                }
            }
            Err(()) => {
                // The other side answers before the connection goes, so that it loses nothing.
                if socket.send(Frame::Close(None)).await.is_ok() {
                    let answered = async { while socket.recv().await.is_some_and(|said| said.is_ok()) {} };
                    let _ = tokio::time::timeout(Duration::from_millis(500), answered).await;
                }
                return;
            }
        }
    }
}

async fn reply(served: &Served, words: &str, role: Role, by: &str) -> Option<Frame> {
    let asked: Value = match serde_json::from_str(words) {
        Ok(asked) => asked,
        Err(e) => return Some(crate::hub::text(&json!({ "type": "answer", "done": false, "text": format!("not understood: {e}") }))),
    };
    let (desk, by, id) = (Arc::clone(&served.desk), by.to_string(), asked.get("id").cloned());
    let reply = tokio::task::spawn_blocking(move || desk.answer(&asked, role, &by)).await.ok()?;
    Some(match reply {
        Reply::Frame(frame) => frame,
        Reply::Words(mut words) => {
            words["type"] = json!("answer");
            words["id"] = id.unwrap_or(Value::Null);
            crate::hub::text(&words)
        }
    })
}
