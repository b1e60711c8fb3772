//! Binds the library's own exp, log, pow … at link time: the interpreter has the C library's loaded before us.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo:rustc-link-arg-cdylib=-Wl,-Bsymbolic,--exclude-libs=ALL");
    }
}
