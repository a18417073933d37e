!> What loads do to a beam on one set of surfaces, beside what swings of itself: on each piece of their course a motion
!> in closed form (docs/theory.md, section 18).
!>
!> Everything that is read off the motion is a row: modes of the set, gaps, forces, indentations and forces in branches
!> of surfaces, the tip, and the points of the loads. A row goes as constant + slope t + Re sum harmonic exp(i W t),
!> besides what swings of modes with which a harmonic load resonates: those start from rest, as there
!> the sum of two great parts would lose its digits.
module phase_drives
   use applied_loads, only: applied_loads_t
   use complementarity, only: solve_active
   use damped_oscillators, only: oscillators_t
   use held_sets, only: free_beam_t, held_set_t
   use kinds, only: wp
   use load_courses, only: piece_at, piece_t
   use small_equations, only: solve_small
   use yielding_stop, only: holds, impedance_t
   implicit none (type, external)
   private
   public :: set_drive_t, phase_drive_t, resonance_t, make_set_drive, start_drive, drive_at, drive_rate_at, &
      resonance_at, exponents_of

   !> A harmonic this near to the frequency of a mode, as a share of it, resonates.
   real(wp), parameter :: resonant = 0.02_wp

   !> So many periods of a load that resonates are a phase at most: bounds grow with its length.
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

   !> A load and a mode of the set with which it resonates.
   type :: resonant_pair_t
      integer :: load = 0
      integer :: mode = 0
      !> The rows per unit of the mode and of its rate, [rows]
      real(wp), allocatable :: row(:), row_of_rate(:)
   end type resonant_pair_t

   !> Answers of a set to unit loads.
   type :: set_drive_t
      type(row_places_t) :: at
      !> To 1, and what t leaves besides t times that, [rows, loads]
      real(wp), allocatable :: constant(:, :), lag(:, :)
      !> To exp(i W t), [rows, loads]
      complex(wp), allocatable :: harmonic(:, :)
      !> The loads in the set's modes, [modes, loads]
      real(wp), allocatable :: load(:, :)
      !> Their parts that the surfaces which hold the beam take at once, [held, loads]
      real(wp), allocatable :: share(:, :)
      type(resonant_pair_t), allocatable :: resonant(:)
   end type set_drive_t

   !> A mode that a harmonic load drives from rest: Re(force E), E'' + 2 a E' + W^2 E = exp(i frequency t).
   type :: resonance_t
      complex(wp) :: force = (0.0_wp, 0.0_wp)
      real(wp) :: frequency = 0.0_wp
      !> a, W^2 and its frequency sqrt(W^2 - a^2)
      real(wp) :: decay = 0.0_wp
      real(wp) :: square = 0.0_wp
      real(wp) :: spread = 0.0_wp
   end type resonance_t

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
      !> And those that resonate, with their pairs
      type(resonance_t), allocatable :: resonance(:)
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
      mobility = matmul(transpose(beam%value(:, held%held)), beam%value(:, held%held))
      allocate (drive%share(size(held%held), total), source=0.0_wp)
      allocate (drive%resonant(0))
      do g = 1, total
         if (size(held%held) > 0) call solve_active(mobility, -matmul(loads%mode(:, g), beam%value(:, held%held)), &
            spread(.true., 1, size(held%held)), drive%share(:, g))
         call answer_at(held, pressed, spring, drive, g, cmplx(0.0_wp, tiny_step, wp), 0, answer)
         drive%constant(:, g) = real(answer, wp)
         drive%lag(:, g) = aimag(answer)/tiny_step
         if (loads%frequency(g) <= 0.0_wp) cycle
         i = 0
         if (size(pressed) == 0) i = mode_in_resonance(held%oscillators, loads%frequency(g))
         if (i > 0) call add_resonance(held, drive, g, i)
         call answer_at(held, pressed, spring, drive, g, cmplx(0.0_wp, loads%frequency(g), wp), i, answer)
         drive%harmonic(:, g) = answer
      end do
   end subroutine make_set_drive

   !> The mode with which a harmonic load resonates; 0: none.
   pure function mode_in_resonance(oscillators, frequency) result(mode)
      type(oscillators_t), intent(in) :: oscillators
      real(wp), intent(in) :: frequency
      integer :: mode

      mode = minloc(abs(oscillators%frequency(:oscillators%oscillating) - frequency), dim=1)
      if (mode == 0) return
      associate (a => oscillators%decay(mode), w => oscillators%spread(mode))
         if (hypot(a, w - frequency) > resonant*frequency) mode = 0
      end associate
   end function mode_in_resonance

   !> A mode that is left out of the answer to a harmonic load.
   subroutine add_resonance(held, drive, load, mode)
      type(held_set_t), intent(in) :: held
      type(set_drive_t), intent(inout) :: drive
      integer, intent(in) :: load
      integer, intent(in) :: mode

      type(resonant_pair_t) :: pair
      integer :: place

      pair%load = load
      pair%mode = mode
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
      drive%resonant = [drive%resonant, pair]
   end subroutine add_resonance

   !> The rows that follow exp(s t) of a unit load.
   pure subroutine answer_at(held, pressed, spring, drive, load, s, left_out, answer)
      type(held_set_t), intent(in) :: held
      integer, intent(in) :: pressed(:)
      type(impedance_t), intent(in) :: spring(:)
      !> Places of the rows, loads in the set's modes
      type(set_drive_t), intent(in) :: drive
      integer, intent(in) :: load
      complex(wp), intent(in) :: s
      !> A mode that stays at rest; 0: none
      integer, intent(in) :: left_out
      !> [rows]
      complex(wp), intent(out) :: answer(:)

      complex(wp), dimension(held%count) :: dynamic, z, viscous
      complex(wp) :: compliance(size(pressed), size(pressed)), force(size(pressed), 1)
      integer :: j, k

      answer = (0.0_wp, 0.0_wp)
      viscous = 1.0_wp + held%oscillators%two_zeta*s
      dynamic = 1.0_wp/(s**2 + held%oscillators%mass_rate(:held%count)*s + viscous*held%oscillators%square)
      if (left_out > 0) dynamic(left_out) = (0.0_wp, 0.0_wp)
      z = dynamic*drive%load(:, load)
      if (size(pressed) > 0) then
         do k = 1, size(pressed)
            do j = 1, size(pressed)
               compliance(j, k) = sum(held%value(:, pressed(j))*held%value(:, pressed(k))*dynamic)
            end do
            if (.not. holds(spring(pressed(k)))) compliance(k, k) = compliance(k, k) &
               + 1.0_wp/response_of(spring(pressed(k)), s)
            force(k, 1) = -sum(held%value(:, pressed(k))*z)
         end do
         force = solve_small(compliance, force)
         do k = 1, size(pressed)
            z = z + dynamic*held%value(:, pressed(k))*force(k, 1)
         end do
      end if
      associate (at => drive%at)
         answer(at%modes + 1:at%modes + held%count) = z
         answer(at%gaps + 1:at%gaps + size(held%gap)) = matmul(z, held%value)
         do k = 1, size(held%held)
            answer(at%forces + held%held(k)) = sum(held%reaction(k, :)*viscous*z) - drive%share(k, load) &
               - sum(held%share(k, pressed)*force(:, 1))
         end do
         do k = 1, size(pressed)
            answer(at%forces + pressed(k)) = force(k, 1)
            answer(at%gaps + pressed(k)) = (0.0_wp, 0.0_wp)
            if (holds(spring(pressed(k)))) cycle
            associate (u => force(k, 1)/response_of(spring(pressed(k)), s), p => pressed(k))
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
      if (.not. allocated(drive%frequency)) allocate (drive%frequency, source=loads%frequencies)
      do g = 1, loads%count
         drive%piece(g) = piece_at(loads%course(g), tau)
      end do
      drive%until = minval(drive%piece%until)
      drive%constant = matmul(set%constant, drive%piece%constant) + matmul(set%lag, drive%piece%slope)
      drive%slope = matmul(set%constant, drive%piece%slope)
      if (allocated(drive%harmonic)) deallocate (drive%harmonic)
      allocate (drive%harmonic(set%at%rows, size(drive%frequency)), source=(0.0_wp, 0.0_wp))
      do g = 1, loads%count
         m = loads%harmonic(g)
         if (m > 0) drive%harmonic(:, m) = drive%harmonic(:, m) + drive%piece(g)%harmonic*set%harmonic(:, g)
      end do
      drive%pair = pack([(i, i=1, size(set%resonant))], abs(drive%piece(set%resonant%load)%harmonic) > 0.0_wp)
      if (allocated(drive%resonance)) deallocate (drive%resonance)
      allocate (drive%resonance(size(drive%pair)))
      do i = 1, size(drive%pair)
         associate (pair => set%resonant(drive%pair(i)), resonance => drive%resonance(i))
            resonance%frequency = drive%piece(pair%load)%frequency
            resonance%force = drive%piece(pair%load)%harmonic*set%load(pair%mode, pair%load)
            resonance%decay = oscillators%decay(pair%mode)
            resonance%square = oscillators%square(pair%mode)
            resonance%spread = oscillators%spread(pair%mode)
            drive%until = min(drive%until, tau + most_periods*2.0_wp*acos(-1.0_wp)/resonance%frequency)
         end associate
      end do
   end subroutine start_drive

   !> Rows at a time since the start of the phase.
   pure function drive_at(set, drive, first, last, time) result(values)
      type(set_drive_t), intent(in) :: set
      type(phase_drive_t), intent(in) :: drive
      !> Which rows
      integer, intent(in) :: first
      integer, intent(in) :: last
      real(wp), intent(in) :: time
      real(wp) :: values(last - first + 1)

      real(wp) :: here(0:1)
      integer :: i, m

      values = drive%constant(first:last) + drive%slope(first:last)*time
      do m = 1, size(drive%frequency)
         values = values + real(drive%harmonic(first:last, m)*turn(drive%frequency(m)*time), wp)
      end do
      do i = 1, size(drive%pair)
         here = resonance_at(drive%resonance(i), time, 1)
         associate (pair => set%resonant(drive%pair(i)))
            values = values + pair%row(first:last)*here(0) + pair%row_of_rate(first:last)*here(1)
         end associate
      end do
   end function drive_at

   !> Their rates.
   pure function drive_rate_at(set, drive, first, last, time) result(rates)
      type(set_drive_t), intent(in) :: set
      type(phase_drive_t), intent(in) :: drive
      integer, intent(in) :: first
      integer, intent(in) :: last
      real(wp), intent(in) :: time
      real(wp) :: rates(last - first + 1)

      real(wp) :: here(0:2)
      integer :: i, m

      rates = drive%slope(first:last)
      do m = 1, size(drive%frequency)
         associate (w => drive%frequency(m))
            rates = rates - w*aimag(drive%harmonic(first:last, m)*turn(w*time))
         end associate
      end do
      do i = 1, size(drive%pair)
         here = resonance_at(drive%resonance(i), time, 2)
         associate (pair => set%resonant(drive%pair(i)))
            rates = rates + pair%row(first:last)*here(1) + pair%row_of_rate(first:last)*here(2)
         end associate
      end do
   end function drive_rate_at

   !> exp(i angle).
   elemental function turn(angle) result(power)
      real(wp), intent(in) :: angle
      complex(wp) :: power

      power = cmplx(cos(angle), sin(angle), wp)
   end function turn

   !> A mode in resonance and its derivatives: the difference of two exponentials over that of their exponents, which
   !> may vanish.
   pure function resonance_at(resonance, time, most) result(derivative)
      type(resonance_t), intent(in) :: resonance
      real(wp), intent(in) :: time
      !> The highest, >= 1
      integer, intent(in) :: most
      real(wp) :: derivative(0:most)

      complex(wp) :: e(0:most), s(2), part(2), drive
      integer :: k

      s = exponents_of(resonance)
      associate (sigma => cmplx(0.0_wp, resonance%frequency, wp))
         drive = turn(resonance%frequency*time)
         part = drive*time*exponential_mean((s - sigma)*time)
         e(0) = (part(1) - part(2))/(s(1) - s(2))
         e(1) = (s(1)*part(1) - s(2)*part(2))/(s(1) - s(2))
         do k = 2, most
            e(k) = sigma**(k - 2)*drive - 2.0_wp*resonance%decay*e(k - 1) - resonance%square*e(k - 2)
         end do
      end associate
      derivative = real(resonance%force*e, wp)
   end function resonance_at

   !> Those of the mode alone, a conjugate pair.
   pure function exponents_of(resonance) result(s)
      type(resonance_t), intent(in) :: resonance
      complex(wp) :: s(2)

      s = [cmplx(-resonance%decay, resonance%spread, wp), cmplx(-resonance%decay, -resonance%spread, wp)]
   end function exponents_of

   !> (exp(x) - 1)/x, without cancellation for small x.
   elemental function exponential_mean(x) result(mean)
      complex(wp), intent(in) :: x
      complex(wp) :: mean

      real(wp) :: half

      if (abs(x) < 1.0e-150_wp) then
         mean = (1.0_wp, 0.0_wp)
         return
      end if
      ! exp(a + i b) - 1 = expm1(a) cos b - 2 sin(b/2)^2 + i exp(a) sin b
      half = sin(0.5_wp*aimag(x))
      mean = cmplx(grown(real(x, wp))*cos(aimag(x)) - 2.0_wp*half**2, exp(real(x, wp))*sin(aimag(x)), wp)/x
   end function exponential_mean

   !> exp(a) - 1.
   elemental function grown(a) result(value)
      real(wp), intent(in) :: a
      real(wp) :: value

      real(wp) :: half

      half = tanh(0.5_wp*a)
      value = 2.0_wp*half/(1.0_wp - half)
   end function grown

end module phase_drives
