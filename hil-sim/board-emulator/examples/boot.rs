use board_emulator::*;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let ms: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let fw = Firmware::read(path.as_ref()).unwrap();
    println!("{:?}", fw.footprint());
    let mut settings = Settings::default();
    if let Ok(v) = std::env::var("IPS") { settings.instructions_per_second = v.parse().unwrap(); }
    if let Ok(v) = std::env::var("STOP_US") { settings.plant_interval = v.parse::<u64>().unwrap() * US; }
    let t = std::time::Instant::now();
    let mut e = Emulation::power_on(&fw, Box::new(plant::Bench::new(24.0)), settings).unwrap();
    println!("power on {:?}", t.elapsed());
    let t = std::time::Instant::now();
    e.run_for(ms * MS).unwrap();
    let w = t.elapsed().as_secs_f64();
    let (log, gaps, resets, bridges, n) = e.at(|s| (s.log_bytes().unwrap(), s.gaps(), s.resets(), s.bridges(), s.instructions())).unwrap();
    for l in fw.decode(&log).unwrap() { println!("{l}"); }
    for g in gaps { println!("{g:?}"); }
    println!("{resets:?} {bridges:?} instr/ms {} ratio {:.2} MIPS {:.1}", n / ms, ms as f64 * 1e-3 / w, n as f64 / w * 1e-6);
}
