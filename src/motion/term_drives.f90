!> Terms of the motion on surfaces that are pressed which loads drive from rest, as slow modes are driven that swing
!> alone: what they do in balance with the loads would be far greater than the motion (docs/theory.md, section 18).
!>
!> A blow of a load makes Re sum c exp(s t) of all that moves, the load itself therefore the sum of the divided
!> differences of c exp(s t) over s and the exponents of the load.
module term_drives
   use applied_loads, only: applied_loads_t
   use complementarity, only: solve_active
   use driven_modes, only: driven_mode_t, make_driven_term
   use held_sets, only: held_set_t
   use joint_modes, only: joint_amplitudes, joint_modes_t
   use kinds, only: wp
   use phase_drives, only: add_driven, answer_at, by_constant, by_harmonic, by_slope, driven_pair_t, set_drive_t
   use yielding_stop, only: holds, impedance_t
   implicit none (type, external)
   private
   public :: drive_terms

contains

   !> The answers of a set, whose slow terms and modes are driven from rest, if it has any.
   subroutine drive_terms(held, pressed, spring, joint, loads, drive)
      type(held_set_t), intent(in) :: held
      !> Surfaces that yield and are closed, and all impedances
      integer, intent(in) :: pressed(:)
      type(impedance_t), intent(in) :: spring(:)
      type(joint_modes_t), intent(in) :: joint
      type(applied_loads_t), intent(in) :: loads
      !> Has the answers of all
      type(set_drive_t), intent(inout) :: drive

      ! what a step in s has to be for the derivative there, which needs no difference
      real(wp), parameter :: tiny_step = 1.0e-100_wp
      complex(wp) :: answer(drive%at%rows), term(drive%at%rows, joint%count)
      real(wp) :: at_once(drive%at%rows)
      logical :: is_slow(joint%count), is_alone(held%count), nowhere(held%count)
      type(set_drive_t) :: rest
      integer :: g, i, k, m

      is_slow = abs(joint%exponent) < loads%slow
      is_alone = .false.
      nowhere = .false.
      is_alone(joint%inactive) = held%oscillators%frequency(joint%inactive) < loads%slow
      if (.not. (any(is_slow) .or. any(is_alone))) return
      rest = drive
      rest%load(:, :) = 0.0_wp
      do k = 1, size(joint%inactive)
         i = joint%inactive(k)
         if (.not. is_alone(i)) rest%load(i, :) = drive%load(i, :)
         if (is_alone(i)) call add_driven(held, i, by_constant, 0, drive)
         if (is_alone(i)) call add_driven(held, i, by_slope, 0, drive)
      end do
      do g = 1, loads%count
         call find_terms(held, pressed, joint, drive, g, term)
         at_once = taken_at_once(held, pressed, joint, drive, g)
         call answer_at(held, pressed, spring, rest, g, cmplx(0.0_wp, tiny_step, wp), nowhere, answer)
         drive%constant(:, g) = real(answer, wp) + at_once
         drive%lag(:, g) = aimag(answer)/tiny_step
         do m = 1, joint%count
            if (is_slow(m)) cycle
            drive%constant(:, g) = drive%constant(:, g) - real(term(:, m)/joint%exponent(m), wp)
            drive%lag(:, g) = drive%lag(:, g) - real(term(:, m)/joint%exponent(m)**2, wp)
         end do
         call add_pairs(joint, loads, is_slow, term, begin_with(pressed, joint, drive, term), g, drive)
         if (loads%frequency(g) <= 0.0_wp .or. loads%frequency(g) >= loads%slow) cycle
         associate (s => cmplx(0.0_wp, loads%frequency(g), wp))
            call answer_at(held, pressed, spring, rest, g, s, nowhere, answer)
            answer = answer + at_once
            do m = 1, joint%count
               if (.not. is_slow(m)) answer = answer + 0.5_wp*(term(:, m)/(s - joint%exponent(m)) &
                  + conjg(term(:, m))/(s - conjg(joint%exponent(m))))
            end do
         end associate
         drive%harmonic(:, g) = answer
         do i = 1, held%count
            if (is_alone(i)) call add_driven(held, i, by_harmonic, g, drive)
         end do
      end do
   end subroutine drive_terms

   !> What a blow of a load makes of the rows: Re sum term exp(s t).
   pure subroutine find_terms(held, pressed, joint, drive, load, term)
      type(held_set_t), intent(in) :: held
      integer, intent(in) :: pressed(:)
      type(joint_modes_t), intent(in) :: joint
      type(set_drive_t), intent(in) :: drive
      integer, intent(in) :: load
      !> [rows, terms]
      complex(wp), intent(out) :: term(:, :)

      complex(wp) :: amplitude(joint%count)
      real(wp) :: nothing(size(pressed)), at_rest(held%count)
      integer :: m

      nothing = 0.0_wp
      at_rest = 0.0_wp
      call joint_amplitudes(held%oscillators%square, joint, nothing, nothing, nothing, at_rest, drive%load(:, load), &
         amplitude)
      amplitude = joint%weight*amplitude
      term = (0.0_wp, 0.0_wp)
      associate (at => drive%at, surfaces => size(held%gap))
         do m = 1, joint%count
            associate (shape => joint%shape(:, m), force => joint%force(:, m))
               term(at%modes + 1:at%gaps, m) = shape
               term(at%gaps + 1:at%gaps + surfaces, m) = matmul(shape, held%value)
               term(at%gaps + pressed, m) = -joint%indentation(:, m)
               term(at%gaps + held%held, m) = (0.0_wp, 0.0_wp)
               term(at%forces + held%held, m) = matmul(held%reaction, shape)*joint%viscous(m) &
                  - matmul(held%share(:, pressed), force)
               term(at%forces + pressed, m) = force
               term(at%depths + pressed, m) = joint%indentation(:, m)
               term(at%branches + pressed, m) = joint%branch(:, m)
               term(at%tip + 1, m) = sum(held%tip_value*shape)
               term(at%loads + 1:, m) = matmul(shape, drive%load)
            end associate
            term(:, m) = amplitude(m)*term(:, m)
         end do
      end associate
   end subroutine find_terms

   !> The part of a load that rigid surfaces take at once, as rows.
   function taken_at_once(held, pressed, joint, drive, load) result(rows)
      type(held_set_t), intent(in) :: held
      integer, intent(in) :: pressed(:)
      type(joint_modes_t), intent(in) :: joint
      type(set_drive_t), intent(in) :: drive
      integer, intent(in) :: load
      real(wp) :: rows(drive%at%rows)

      integer, allocatable :: rigid(:)
      real(wp), allocatable :: mobility(:, :), force(:)

      rows = 0.0_wp
      allocate (rigid, source=pack(pressed, holds(joint%spring)))
      if (size(rigid) == 0) return
      allocate (mobility, source=matmul(transpose(held%value(:, rigid)), held%value(:, rigid)))
      allocate (force(size(rigid)))
      call solve_active(mobility, matmul(drive%load(:, load), held%value(:, rigid)), spread(.true., 1, size(rigid)), &
         force)
      rows(drive%at%forces + rigid) = force
   end function taken_at_once

   !> Where the rows begin after a blow of a load, the sum of all terms: displacements and what springs keep of them
   !> with nothing, dampers and rigid surfaces with a force.
   pure function begin_with(pressed, joint, drive, term) result(rows)
      integer, intent(in) :: pressed(:)
      type(joint_modes_t), intent(in) :: joint
      type(set_drive_t), intent(in) :: drive
      !> [rows, terms]
      complex(wp), intent(in) :: term(:, :)
      real(wp) :: rows(size(term, 1))

      integer :: k

      rows = 0.0_wp
      associate (at => drive%at)
         rows(at%forces + 1:at%depths) = sum(real(term(at%forces + 1:at%depths, :), wp), dim=2)
         do k = 1, size(pressed)
            if (.not. holds(joint%spring(k))) rows(at%forces + pressed(k)) = joint%spring(k)%viscosity &
               *sum(real(joint%exponent*term(at%depths + pressed(k), :), wp))
         end do
      end associate
   end function begin_with

   !> The slow terms, as pairs of an exponent and its conjugate. Of those that stay slow through the run c (f(s) - f(0))
   !> and c f(0) are taken apart, as the sum of all c is known: that of theirs has no rounding of its own.
   subroutine add_pairs(joint, loads, is_slow, term, beginning, load, drive)
      type(joint_modes_t), intent(in) :: joint
      type(applied_loads_t), intent(in) :: loads
      logical, intent(in) :: is_slow(:)
      !> [rows, terms]
      complex(wp), intent(in) :: term(:, :)
      !> Their sum, [rows]
      real(wp), intent(in) :: beginning(:)
      integer, intent(in) :: load
      type(set_drive_t), intent(inout) :: drive

      complex(wp), parameter :: zero = (0.0_wp, 0.0_wp)
      real(wp) :: left(drive%at%rows)
      logical :: stays(size(is_slow))
      integer :: m

      stays = is_slow .and. abs(joint%exponent) < 1.0_wp/loads%duration
      left = beginning
      do m = 1, size(stays)
         associate (s => joint%exponent(m), c => term(:, m))
            if (stays(m)) then
               call add_pair(make_driven_term(s, .true.), -real(c, wp)*abs(s)**2, real(c*s, wp))
               cycle
            end if
            left = left - real(c, wp)
            if (is_slow(m)) call add_pair(make_driven_term(s, .false.), -real(c*conjg(s), wp), real(c, wp))
         end associate
      end do
      if (any(stays)) call add_pair(make_driven_term(zero, .false.), 0.0_wp*left, left)

   contains

      !> What of the load drives it.
      subroutine add_pair(oscillator, row, row_of_rate)
         type(driven_mode_t), intent(in) :: oscillator
         real(wp), intent(in) :: row(:)
         real(wp), intent(in) :: row_of_rate(:)

         type(driven_pair_t) :: pair

         pair%oscillator = oscillator
         pair%load = load
         allocate (pair%row, source=row)
         allocate (pair%row_of_rate, source=row_of_rate)
         allocate (pair%share(loads%count), source=0.0_wp)
         pair%share(load) = 1.0_wp
         pair%part = by_constant
         drive%driven = [drive%driven, pair]
         pair%part = by_slope
         drive%driven = [drive%driven, pair]
         if (loads%frequency(load) <= 0.0_wp .or. loads%frequency(load) >= loads%slow) return
         pair%part = by_harmonic
         drive%driven = [drive%driven, pair]
      end subroutine add_pair
   end subroutine add_pairs

end module term_drives
