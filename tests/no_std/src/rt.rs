//! What `std` would bring along: memory, panics and output.

use core::alloc::{GlobalAlloc, Layout};
use core::cell::UnsafeCell;
use core::fmt;
use core::ptr::null_mut;
use core::sync::atomic::{AtomicUsize, Ordering};

#[link(name = "c")]
unsafe extern "C" {
    fn write(file: i32, bytes: *const u8, count: usize) -> isize;
    fn abort() -> !;
}

const HEAP: usize = 64 << 20;

/// Hands out memory from the front of a fixed block and never takes any back.
#[repr(align(64))]
struct Bump {
    memory: UnsafeCell<[u8; HEAP]>,
    used: AtomicUsize,
}

// Every byte is handed out once.
unsafe impl Sync for Bump {}

unsafe impl GlobalAlloc for Bump {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let start = self.memory.get().cast::<u8>();
        let mut at = 0;
        let taken = self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |used| {
            at = (start as usize + used).next_multiple_of(layout.align()) - start as usize;
            at.checked_add(layout.size()).filter(|end| *end <= HEAP)
        });
        if taken.is_ok() { unsafe { start.add(at) } } else { null_mut() }
    }

    unsafe fn dealloc(&self, _memory: *mut u8, _layout: Layout) {}
}

#[global_allocator]
static BUMP: Bump = Bump { memory: UnsafeCell::new([0; HEAP]), used: AtomicUsize::new(0) };

/// Standard output, or standard error.
pub struct Out(pub i32);

impl fmt::Write for Out {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let written = unsafe { write(self.0, text.as_ptr(), text.len()) };
        if written == text.len() as isize { Ok(()) } else { Err(fmt::Error) }
    }
}

macro_rules! println {
    ($($argument:tt)*) => {{
        use core::fmt::Write as _;
        writeln!($crate::rt::Out(1), $($argument)*).expect("standard output is open")
    }};
}
pub(crate) use println;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    use fmt::Write as _;
    let _ = writeln!(Out(2), "{info}");
    unsafe { abort() }
}

/// The precompiled `alloc` can unwind, and so refers to this. Nothing here ever does.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}
