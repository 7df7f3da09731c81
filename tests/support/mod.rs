//! Helpers that the vehicle's tests share.
#![allow(dead_code)] // Each test binary uses part of it.

pub mod flights;
pub mod generated;
pub mod kerbs;
pub mod slopes;

use std::collections::VecDeque;

use firmware::drive_board::SCALES;
use firmware::protocol::message::{Answer, BoardStatus, COMMAND_PERIOD_MS, Order};
use model::command::{DriveCommand, Request};
use model::status::Status;
use model::supervise::arming::Mode;
use model::vehicle::Vehicle;
use plant::Plant;
use plant::fault::SensorFault;
use plant::settings::PlantSettings;
use plant::terrain::Terrain;
use virtual_board::board::VirtualBoard;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::link_client::LinkClient;
use virtual_board::scenario::Sensor;

/// The reference vehicle.
pub fn reference() -> Vehicle<f64> {
    let text = include_str!("../../vehicles/reference.toml");
    match vehicle_file::parse("vehicles/reference.toml", text) {
        Ok(vehicle_file::VehicleFile::Vehicle(vehicle)) => *vehicle,
        other => panic!("{other:?}"),
    }
}

/// A board on its bench: a vehicle on level ground, and an operator.
pub struct Bench {
    pub board: VirtualBoard,
    pub client: LinkClient,
    /// The command that the operator repeats every [`COMMAND_PERIOD_MS`], if any: speed, m/s, and yaw rate, rad/s.
    pub drive: Option<[f32; 2]>,
    /// The bytes that the operator's port has sent, each with the millisecond.
    pub sent: Vec<(u64, Vec<u8>)>,
    /// How long bytes travel to the board, and from it, ms.
    pub latency_ms: [u64; 2],
    /// Bytes in transit, each with the time at which they are due.
    to_board: VecDeque<(u64, Vec<u8>)>,
    to_host: VecDeque<(u64, Vec<u8>)>,
    ms: u64,
}

impl Bench {
    pub fn new(seed: u64) -> Self {
        Self::with(seed, VirtualFlash::erased())
    }

    pub fn with(seed: u64, flash: VirtualFlash) -> Self {
        Self::with_history(seed, flash, VirtualFlash::erased())
    }

    /// A bench with the flashes of parameters and fault history as an earlier run left them.
    pub fn with_history(seed: u64, flash: VirtualFlash, history: VirtualFlash) -> Self {
        Self::with_settings(seed, flash, history, &PlantSettings::default())
    }

    /// A bench whose vehicle differs from its file.
    pub fn with_settings(seed: u64, flash: VirtualFlash, history: VirtualFlash, settings: &PlantSettings) -> Self {
        Self::of(&reference(), seed, flash, history, settings)
    }

    /// With another vehicle than the reference vehicle.
    pub fn of(
        vehicle: &Vehicle<f64>,
        seed: u64,
        flash: VirtualFlash,
        history: VirtualFlash,
        settings: &PlantSettings,
    ) -> Self {
        let ground = Terrain::default();
        let plant = Plant::with_settings(vehicle, &SCALES, ground, seed, settings).expect("level ground");
        let board = VirtualBoard::boot_with_history(vehicle, plant, flash, history).expect("boots");
        Self {
            board,
            client: LinkClient::new(seed as u32),
            drive: Some([0.0, 0.0]),
            sent: Vec::new(),
            latency_ms: [0, 0],
            to_board: VecDeque::new(),
            to_host: VecDeque::new(),
            ms: 0,
        }
    }

    /// Lets `ms` milliseconds pass, and calls `each` after every millisecond.
    pub fn run_watching(&mut self, ms: u64, mut each: impl FnMut(&mut Self)) {
        for _ in 0..ms {
            if self.ms.is_multiple_of(COMMAND_PERIOD_MS) {
                if self.client.identity().is_none() {
                    let frame = self.client.identify();
                    self.put(&frame);
                }
                if let Some([speed_m_s, yaw_rate_rad_s]) = self.drive {
                    self.order(Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s)));
                }
            }
            while let Some((_, bytes)) = self.to_board.pop_front_if(|(due_ms, _)| *due_ms <= self.ms) {
                self.board.send(&bytes);
            }
            self.ms += 1;
            self.board.run_until(self.ms * 1000);
            let bytes = self.board.receive();
            self.to_host.push_back((self.ms + self.latency_ms[1], bytes));
            while let Some((_, bytes)) = self.to_host.pop_front_if(|(due_ms, _)| *due_ms <= self.ms) {
                self.client.receive(self.ms * 1000, &bytes);
            }
            each(self);
        }
    }

    /// Milliseconds since boot.
    pub fn now_ms(&self) -> u64 {
        self.ms
    }

    /// Lets time pass with nobody at the board's port: [`VirtualBoard::receive`] returns the bytes that it sends meanwhile.
    pub fn run_raw(&mut self, ms: u64) {
        self.ms += ms;
        self.board.run_until(self.ms * 1000);
    }

    pub fn run(&mut self, ms: u64) {
        self.run_watching(ms, |_| {});
    }

    /// Sends bytes to the board.
    pub fn put(&mut self, bytes: &[u8]) {
        self.sent.push((self.ms, bytes.to_vec()));
        if self.latency_ms[0] == 0 && self.to_board.is_empty() {
            self.board.send(bytes);
        } else {
            self.to_board.push_back((self.ms + self.latency_ms[0], bytes.to_vec()));
        }
    }

    /// The number and the frame of an order given now; nothing before the board has identified itself.
    pub fn frame(&mut self, order: Order) -> Option<(u32, Vec<u8>)> {
        self.client.order(self.ms * 1000, order)
    }

    /// Gives an order and returns its number. Before the board has identified itself, sends nothing and returns 0.
    pub fn order(&mut self, order: Order) -> u32 {
        let Some((sequence, frame)) = self.frame(order) else {
            return 0;
        };
        self.put(&frame);
        sequence
    }

    /// Gives an order and waits up to 100 ms for its answer.
    pub fn ask(&mut self, order: Order) -> Option<Answer> {
        let sequence = self.order(order);
        let mut answer = None;
        self.run_watching(100, |bench| {
            if answer.is_none() {
                answer = bench.client.answer_to(sequence);
            }
        });
        answer
    }

    pub fn request(&mut self, request: Request) {
        match request {
            Request::None => {}
            Request::Disarm => {
                let (_, frame) = self.client.disarm();
                self.put(&frame);
            }
            request => {
                self.order(Order::Request(request));
            }
        }
    }

    pub fn status(&self) -> BoardStatus {
        self.client.status.expect("the board speaks")
    }

    /// The vehicle's status after its first tick.
    pub fn first_status(&mut self) -> Status {
        self.run_raw(2);
        self.board.status().expect("the board runs")
    }

    pub fn mode(&self) -> Mode {
        self.board.status().expect("the board runs").mode
    }

    /// Presses the emergency stop: both of its contacts open, and the hardware break opens the bridges.
    pub fn press_emergency_stop(&mut self) {
        self.board.world(|world| world.press_stop(true));
    }

    /// Lets a sensor fail, or work again.
    pub fn set_fault(&mut self, sensor: Sensor, fault: SensorFault) {
        self.board.world(|world| {
            assert!(
                sensor != Sensor::SparImu || world.plant.spar_imu().is_some(),
                "the vehicle has no spar"
            );
            sensor.set_fault(&mut world.plant, fault);
        });
    }

    pub fn bridges_on(&mut self) -> bool {
        self.board.world(|world| world.bridges_on())
    }

    /// A bench whose vehicle has booted, calibrated its gyros and armed.
    pub fn armed(seed: u64) -> Self {
        let mut bench = Self::new(seed);
        bench.run(1000);
        bench.request(Request::Arm);
        bench.run(20);
        assert_eq!(bench.mode(), Mode::Armed, "{:?}", bench.status().vehicle.blockers);
        bench
    }

    /// A bench whose vehicle is armed and drives straight at `speed_m_s`.
    pub fn driving(seed: u64, speed_m_s: f32) -> Self {
        let mut bench = Self::armed(seed);
        bench.drive = Some([speed_m_s, 0.0]);
        bench.run(5000);
        assert_eq!(bench.mode(), Mode::Armed);
        let speed = bench.board.world(|world| world.plant.truth().speed_m_s);
        assert!((speed - f64::from(speed_m_s)).abs() < 0.25, "speed {speed}");
        bench
    }
}
