!> What loads do to a beam on one set of surfaces, beside what swings of itself: on each piece of their course a motion
!> in closed form (docs/theory.md, section 18).
!>
!> Everything that is read off the motion is a row: modes of the set, gaps, forces, indentations and forces in branches
!> of surfaces, the tip, and the points of the loads. A row goes as constant + slope t + Re sum harmonic exp(i W t),
!> besides modes that start from rest, as there the sum of two great parts would lose its digits: those with which a
!> harmonic load resonates, and those so slow that loads hardly meet their stiffness.
module phase_drives
   use applied_loads, only: applied_loads_t, bear_whole
   use complementarity, only: solve_active
   use damped_oscillators, only: oscillators_t
   use driven_modes, only: driven_mode_at, driven_mode_t, make_driven_mode
   use driven_signal, only: driven_signal_t, turn_of
   use held_sets, only: free_beam_t, held_set_t
   use kinds, only: wp
   use load_courses, only: piece_at, piece_t
   use point_forces, only: find_point_forces
   use power_integrals, only: make_power_form, power_form_t
   use yielding_stop, only: holds, impedance_t
   implicit none (type, external)
   private
   public :: set_drive_t, phase_drive_t, make_set_drive, ready_for_terms, start_drive, drive_at, find_rows_at
   public :: answer_at, by_constant, by_harmonic

   !> A harmonic this near to the frequency of a mode, as a share of it, resonates.
   real(wp), parameter :: resonant = 0.02_wp

   !> So many periods of a load that drives modes from rest are a phase at most: bounds grow with its length.
   real(wp), parameter :: most_periods = 2.0_wp

   !> Where the rows of each kind begin, less one.
   type :: row_places_t
      integer :: modes = 0
      integer :: gaps = 0
      integer :: forces = 0
      integer :: depths = 0
      integer :: branches = 0
      integer :: tip = 0
      integer :: loads = 0
      integer :: rows = 0
   end type row_places_t

   !> What of a load drives a mode from rest.
   integer, parameter :: by_constant = 1
   integer, parameter :: by_slope = 2
   integer, parameter :: by_harmonic = 3

   !> A mode of the set that is driven from rest.
   type :: driven_pair_t
      integer :: mode = 0
      !> One of the `by_` constants
      integer :: part = 0
      !> Which load does; 0: all of them
      integer :: load = 0
      !> The rows per unit of the mode and of its rate, [rows]
      real(wp), allocatable :: row(:), row_of_rate(:)
   end type driven_pair_t

   !> Answers of a set to unit loads.
   type :: set_drive_t
      type(row_places_t) :: at
      !> To 1, and what t leaves besides t times that, [rows, loads]
      real(wp), allocatable :: constant(:, :), lag(:, :)
      !> To exp(i W t), [rows, loads]
      complex(wp), allocatable :: harmonic(:, :)
      !> Of each mode alone to exp(i W t), as time runs backward, [modes, loads]
      complex(wp), allocatable :: backward(:, :)
      !> The loads in the set's modes, [modes, loads]
      real(wp), allocatable :: load(:, :)
      !> Their parts that the surfaces which hold the beam take at once, [held, loads]
      real(wp), allocatable :: share(:, :)
      type(driven_pair_t), allocatable :: driven(:)
      !> Where surfaces yield: the loads on the terms of the motion, [count, loads], and integrals of products of these,
      !> of the harmonics and of a constant
      complex(wp), allocatable :: term_load(:, :)
      type(power_form_t) :: products
      !> Gaps as signals, where no surface yields, [surfaces]; their state and terms are set by who looks at them
      type(driven_signal_t), allocatable :: gap(:)
   end type set_drive_t

   !> The rows during a phase.
   type :: phase_drive_t
      !> tau at its start, and at which it has to end
      real(wp) :: tau = 0.0_wp
      real(wp) :: until = huge(1.0_wp)
      !> The loads, [loads]
      type(piece_t), allocatable :: piece(:)
      !> [rows], [rows, harmonics]
      real(wp), allocatable :: constant(:), slope(:)
      complex(wp), allocatable :: harmonic(:, :)
      !> [harmonics]
      real(wp), allocatable :: frequency(:)
      !> And modes driven from rest, with their pairs
      type(driven_mode_t), allocatable :: mode(:)
      integer, allocatable :: pair(:)
   end type phase_drive_t

contains

   !> The answers of a set.
   subroutine make_set_drive(beam, held, pressed, spring, loads, drive)
      type(free_beam_t), intent(in) :: beam
      type(held_set_t), intent(in) :: held
      !> Surfaces that yield and are closed, and all impedances
      integer, intent(in) :: pressed(:)
      type(impedance_t), intent(in) :: spring(:)
      type(applied_loads_t), intent(in) :: loads
      type(set_drive_t), intent(out) :: drive

      ! what a step in s has to be for the derivative there, which needs no difference
      real(wp), parameter :: tiny_step = 1.0e-100_wp
      complex(wp), allocatable :: answer(:)
      logical, dimension(held%count) :: is_slow, is_driven
      real(wp) :: mobility(size(held%held), size(held%held))
      integer :: g, i, surfaces, total

      surfaces = size(held%gap)
      total = loads%count
      drive%at%gaps = held%count
      drive%at%forces = drive%at%gaps + surfaces
      drive%at%depths = drive%at%forces + surfaces
      drive%at%branches = drive%at%depths + surfaces
      drive%at%tip = drive%at%branches + surfaces
      drive%at%loads = drive%at%tip + 1
      drive%at%rows = drive%at%loads + total
      associate (rows => drive%at%rows)
         allocate (drive%constant(rows, total), drive%lag(rows, total), source=0.0_wp)
         allocate (drive%harmonic(rows, total), source=(0.0_wp, 0.0_wp))
         allocate (answer(rows))
      end associate
      if (allocated(held%mode)) then
         allocate (drive%load, source=matmul(transpose(held%mode), loads%mode))
      else
         allocate (drive%load, source=loads%mode)
      end if
      allocate (drive%backward(held%count, total), source=(0.0_wp, 0.0_wp))
      do i = 1, size(held%held)
         mobility(:, i) = [(sum(beam%value(:, held%held(g))*beam%value(:, held%held(i))), g=1, size(held%held))]
      end do
      allocate (drive%share(size(held%held), total), source=0.0_wp)
      do g = 1, total
         if (size(held%held) == 0) exit
         call solve_active(mobility, -matmul(loads%mode(:, g), beam%value(:, held%held)), &
            spread(.true., 1, size(held%held)), drive%share(:, g))
         call bear_whole(beam%value(:, held%held), loads%mode(:, g), drive%share(:, g), drive%load(:, g))
      end do
      allocate (drive%driven(0))
      is_slow = held%oscillators%frequency < loads%slow .and. size(pressed) == 0
      do i = 1, held%count
         if (is_slow(i)) call add_driven(held, i, by_constant, 0, drive)
         if (is_slow(i)) call add_driven(held, i, by_slope, 0, drive)
      end do
      do g = 1, total
         call answer_at(held, pressed, spring, drive, g, cmplx(0.0_wp, tiny_step, wp), is_slow, answer)
         drive%constant(:, g) = real(answer, wp)
         drive%lag(:, g) = aimag(answer)/tiny_step
         if (loads%frequency(g) <= 0.0_wp) cycle
         is_driven = size(pressed) == 0 .and. (resonates(held%oscillators, loads%frequency(g)) .or. &
            (is_slow .and. loads%frequency(g) < loads%slow))
         do i = 1, held%count
            if (is_driven(i)) call add_driven(held, i, by_harmonic, g, drive)
         end do
         call answer_at(held, pressed, spring, drive, g, cmplx(0.0_wp, loads%frequency(g), wp), is_driven, answer)
         drive%harmonic(:, g) = answer
         drive%backward(:, g) = backward_of(held%oscillators, drive%load(:, g), loads%frequency(g), is_driven)
      end do
      if (size(pressed) > 0) return
      allocate (drive%gap(surfaces))
      do i = 1, surfaces
         allocate (drive%gap(i)%free, source=held%gap(i))
      end do
   end subroutine make_set_drive

   !> Answer of modes to a load, with their damping turned round.
   pure function backward_of(oscillators, load, frequency, left_out) result(answer)
      type(oscillators_t), intent(in) :: oscillators
      !> [modes]
      real(wp), intent(in) :: load(:)
      real(wp), intent(in) :: frequency
      !> Modes that stay at rest, [modes]
      logical, intent(in) :: left_out(:)
      complex(wp) :: answer(size(load))

      real(wp) :: damping(size(load))

      answer = (0.0_wp, 0.0_wp)
      damping = oscillators%two_zeta*oscillators%square + oscillators%mass_rate(:size(load))
      where (.not. left_out) answer = load/cmplx(oscillators%square - frequency**2, -damping*frequency, wp)
   end function backward_of

   !> What work of loads and losses in stops need of the terms of a set on surfaces that yield.
   subroutine ready_for_terms(exponent, shape, frequency, drive)
      !> [count]
      complex(wp), intent(in) :: exponent(:)
      !> Modes of the set per unit of each, [modes, count]
      complex(wp), intent(in) :: shape(:, :)
      !> With which loads swing, [harmonics]
      real(wp), intent(in) :: frequency(:)
      type(set_drive_t), intent(inout) :: drive

      integer :: all, m

      if (allocated(drive%term_load)) deallocate (drive%term_load)
      allocate (drive%term_load(size(exponent), size(drive%load, 2)))
      do m = 1, size(exponent)
         drive%term_load(m, :) = matmul(shape(:, m), drive%load)
      end do
      all = size(exponent) + size(frequency) + 1
      call make_power_form([exponent, cmplx(0.0_wp, frequency, wp), (0.0_wp, 0.0_wp)], &
         reshape([((1.0_wp, 0.0_wp), m=1, all)], [1, all]), drive%products)
   end subroutine ready_for_terms

   !> With which modes does a harmonic load resonate?
   pure function resonates(oscillators, frequency) result(does)
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: frequency
      logical :: does(oscillators%count)

      does = .false.
      associate (n => oscillators%oscillating)
         does(:n) = hypot(oscillators%decay(:n), oscillators%spread(:n) - frequency) <= resonant*frequency
      end associate
   end function resonates

   !> A mode that is left out of the answer to a load.
   subroutine add_driven(held, mode, part, load, drive)
      type(held_set_t), intent(in) :: held
      integer, intent(in) :: mode
      !> One of the `by_` constants
      integer, intent(in) :: part
      !> Which load; 0: all
      integer, intent(in) :: load
      type(set_drive_t), intent(inout) :: drive

      type(driven_pair_t) :: pair
      integer :: place

      pair%mode = mode
      pair%part = part
      pair%load = load
      allocate (pair%row(drive%at%rows), pair%row_of_rate(drive%at%rows), source=0.0_wp)
      associate (at => drive%at, surfaces => size(held%gap))
         pair%row(at%modes + mode) = 1.0_wp
         pair%row(at%gaps + 1:at%gaps + surfaces) = held%value(mode, :)
         do place = 1, size(held%held)
            pair%row(at%forces + held%held(place)) = held%reaction(place, mode)
            pair%row_of_rate(at%forces + held%held(place)) = held%oscillators%two_zeta*held%reaction(place, mode)
         end do
         pair%row(at%tip + 1) = held%tip_value(mode)
         pair%row(at%loads + 1:) = drive%load(mode, :)
      end associate
      drive%driven = [drive%driven, pair]
   end subroutine add_driven

   !> The rows that follow exp(s t) of a unit load.
   pure subroutine answer_at(held, pressed, spring, drive, load, s, left_out, answer)
      type(held_set_t), intent(in) :: held
      integer, intent(in) :: pressed(:)
      type(impedance_t), intent(in) :: spring(:)
      !> Places of the rows, loads in the set's modes
      type(set_drive_t), intent(in) :: drive
      integer, intent(in) :: load
      complex(wp), intent(in) :: s
      !> Modes that stay at rest, [modes]
      logical, intent(in) :: left_out(:)
      !> [rows]
      complex(wp), intent(out) :: answer(:)

      complex(wp), dimension(held%count) :: dynamic, z, viscous
      complex(wp), dimension(size(pressed)) :: flexibility, force, unmoved
      integer :: k

      answer = (0.0_wp, 0.0_wp)
      viscous = 1.0_wp + held%oscillators%two_zeta*s
      dynamic = s**2 + held%oscillators%mass_rate(:held%count)*s + viscous*held%oscillators%square
      if (size(pressed) > 0) then
         unmoved = (0.0_wp, 0.0_wp)
         flexibility = (0.0_wp, 0.0_wp)
         where (.not. holds(spring(pressed))) flexibility = 1.0_wp/response_of(spring(pressed), s)
         call find_point_forces(dynamic, held%value(:, pressed), flexibility, cmplx(drive%load(:, load), 0.0_wp, wp), &
            unmoved, force, z)
      else
         z = (0.0_wp, 0.0_wp)
         where (.not. left_out) z = drive%load(:, load)/dynamic
      end if
      associate (at => drive%at)
         answer(at%modes + 1:at%modes + held%count) = z
         answer(at%gaps + 1:at%gaps + size(held%gap)) = matmul(z, held%value)
         do k = 1, size(held%held)
            answer(at%forces + held%held(k)) = sum(held%reaction(k, :)*viscous*z) - drive%share(k, load) &
               - sum(held%share(k, pressed)*force)
         end do
         do k = 1, size(pressed)
            answer(at%forces + pressed(k)) = force(k)
            answer(at%gaps + pressed(k)) = (0.0_wp, 0.0_wp)
            if (holds(spring(pressed(k)))) cycle
            associate (u => force(k)*flexibility(k), p => pressed(k))
               answer(at%depths + p) = u
               answer(at%gaps + p) = -u
               answer(at%branches + p) = spring(p)%branch_stiffness*s/(s + spring(p)%relaxation_rate)*u
            end associate
         end do
         answer(at%tip + 1) = sum(held%tip_value*z)
         answer(at%loads + 1:) = matmul(z, drive%load)
      end associate
   end subroutine answer_at

   !> P per unit of u exp(s t).
   elemental function response_of(spring, s) result(stiffness)
      type(impedance_t), intent(in) :: spring
      complex(wp), intent(in) :: s
      complex(wp) :: stiffness

      stiffness = spring%stiffness + spring%viscosity*s
      if (spring%branch_stiffness > 0.0_wp) then
         stiffness = stiffness + spring%branch_stiffness*s/(s + spring%relaxation_rate)
      end if
   end function response_of

   !> The rows from an instant on.
   subroutine start_drive(set, oscillators, loads, tau, drive)
      type(set_drive_t), intent(in) :: set
      !> Of the set
      type(oscillators_t), intent(in) :: oscillators
      type(applied_loads_t), intent(in) :: loads
      real(wp), intent(in) :: tau
      type(phase_drive_t), intent(inout) :: drive

      integer :: g, i, m

      drive%tau = tau
      if (.not. allocated(drive%piece)) allocate (drive%piece(loads%count))
      drive%frequency = loads%frequencies
      do g = 1, loads%count
         drive%piece(g) = piece_at(loads%course(g), tau)
      end do
      drive%until = minval(drive%piece%until)
      if (allocated(drive%slope)) then
         if (size(drive%harmonic, 1) /= set%at%rows .or. size(drive%harmonic, 2) /= size(drive%frequency)) then
            deallocate (drive%constant, drive%slope, drive%harmonic)
         end if
      end if
      if (.not. allocated(drive%slope)) then
         allocate (drive%constant(set%at%rows), drive%slope(set%at%rows))
         allocate (drive%harmonic(set%at%rows, size(drive%frequency)))
      end if
      drive%constant(:) = 0.0_wp
      drive%slope(:) = 0.0_wp
      drive%harmonic(:, :) = (0.0_wp, 0.0_wp)
      do g = 1, loads%count
         associate (piece => drive%piece(g))
            if (abs(piece%constant) > 0.0_wp) drive%constant(:) = drive%constant + set%constant(:, g)*piece%constant
            if (abs(piece%slope) > 0.0_wp) then
               drive%constant(:) = drive%constant + set%lag(:, g)*piece%slope
               drive%slope(:) = drive%slope + set%constant(:, g)*piece%slope
            end if
            m = loads%harmonic(g)
            if (m == 0) cycle
            !$omp simd
            do i = 1, set%at%rows
               drive%harmonic(i, m) = drive%harmonic(i, m) + piece%harmonic*set%harmonic(i, g)
            end do
         end associate
      end do
      call start_modes(set, oscillators, drive)
   end subroutine start_drive

   !> Modes that are driven from rest.
   subroutine start_modes(set, oscillators, drive)
      type(set_drive_t), intent(in) :: set
      !> Of the set
      type(oscillators_t), intent(in) :: oscillators
      !> Its pieces are there
      type(phase_drive_t), intent(inout) :: drive

      complex(wp) :: force(size(set%driven))
      integer :: i

      if (size(set%driven) == 0 .and. allocated(drive%pair)) then
         if (size(drive%pair) == 0) return
      end if
      do i = 1, size(set%driven)
         associate (pair => set%driven(i), piece => drive%piece)
            select case (pair%part)
            case (by_constant)
               force(i) = sum(set%load(pair%mode, :)*piece%constant)
            case (by_slope)
               force(i) = sum(set%load(pair%mode, :)*piece%slope)
            case default
               force(i) = set%load(pair%mode, pair%load)*piece(pair%load)%harmonic
            end select
         end associate
      end do
      drive%pair = pack([(i, i=1, size(set%driven))], abs(force) > 0.0_wp)
      if (allocated(drive%mode)) deallocate (drive%mode)
      allocate (drive%mode(size(drive%pair)))
      do i = 1, size(drive%pair)
         associate (pair => set%driven(drive%pair(i)), mode => drive%mode(i))
            mode = make_driven_mode(oscillators, pair%mode)
            mode%force = force(drive%pair(i))
            mode%is_ramp = pair%part == by_slope
            if (pair%part /= by_harmonic) cycle
            mode%frequency = drive%piece(pair%load)%frequency
            drive%until = min(drive%until, drive%tau + most_periods*2.0_wp*acos(-1.0_wp)/mode%frequency)
         end associate
      end do
   end subroutine start_modes

   !> Rows at a time since the start of the phase, or their rates.
   pure function drive_at(set, drive, first, last, time, order) result(values)
      type(set_drive_t), intent(in) :: set
      type(phase_drive_t), intent(in) :: drive
      !> Which rows
      integer, intent(in) :: first
      integer, intent(in) :: last
      real(wp), intent(in) :: time
      !> 0: the rows, 1: their rates
      integer, intent(in) :: order
      real(wp) :: values(last - first + 1)

      real(wp), dimension(last - first + 1) :: rows, rates

      call find_rows_at(set, drive, first, last, time, rows, rates)
      if (order == 0) values = rows
      if (order > 0) values = rates
   end function drive_at

   !> Both.
   pure subroutine find_rows_at(set, drive, first, last, time, rows, rates, turn)
      type(set_drive_t), intent(in) :: set
      type(phase_drive_t), intent(in) :: drive
      !> Which rows
      integer, intent(in) :: first
      integer, intent(in) :: last
      real(wp), intent(in) :: time
      !> [last - first + 1]
      real(wp), contiguous, intent(out) :: rows(:)
      real(wp), contiguous, intent(out) :: rates(:)
      !> exp(i W t), where it is known, [harmonics]
      complex(wp), intent(in), optional :: turn(:)

      complex(wp) :: turned(size(drive%frequency))
      real(wp) :: here(0:2)
      integer :: i, m

      !$omp simd
      do i = 1, size(rows)
         rates(i) = drive%slope(first - 1 + i)
         rows(i) = drive%constant(first - 1 + i) + rates(i)*time
      end do
      if (present(turn)) then
         turned = turn
      else
         turned = turn_of(drive%frequency, time)
      end if
      do m = 1, size(drive%frequency)
         call add_harmonic(drive%harmonic(first:last, m), drive%frequency(m), turned(m), rows, rates)
      end do
      do m = 1, size(drive%pair)
         here = driven_mode_at(drive%mode(m), time, 2)
         associate (pair => set%driven(drive%pair(m)))
            rows = rows + pair%row(first:last)*here(0) + pair%row_of_rate(first:last)*here(1)
            rates = rates + pair%row(first:last)*here(1) + pair%row_of_rate(first:last)*here(2)
         end associate
      end do
   end subroutine find_rows_at

   !> One that has turned.
   pure subroutine add_harmonic(harmonic, frequency, turn, rows, rates)
      complex(wp), contiguous, intent(in) :: harmonic(:)
      real(wp), intent(in) :: frequency
      complex(wp), intent(in) :: turn
      !> As many
      real(wp), contiguous, intent(inout) :: rows(:)
      real(wp), contiguous, intent(inout) :: rates(:)

      real(wp) :: cosine, even, odd, sine
      integer :: i

      cosine = real(turn, wp)
      sine = aimag(turn)
      !$omp simd private(even, odd)
      do i = 1, size(harmonic)
         even = real(harmonic(i), wp)
         odd = aimag(harmonic(i))
         rows(i) = rows(i) + (even*cosine - odd*sine)
         rates(i) = rates(i) - frequency*(even*sine + odd*cosine)
      end do
   end subroutine add_harmonic

end module phase_drives
