#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| cdem_verify::readers::start(bytes));
