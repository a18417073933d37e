!> What a Newmark step adds to the statistics of a run: displacements go as cubics between the
!> ends of the step, forces on straight lines (docs/theory.md, section 20).
module newmark_statistics
   use block_statistics, only: blocks_begun, open_blocks, take_contact, take_flight
   use kinds, only: wp
   use newmark_run, only: is_held, is_in_contact, newmark_run_t
   use run_settings, only: run_settings_t
   use statistic_types, only: low_displacement, low_tip, sum_displacement, sum_square_displacement, &
      sum_square_tip, sum_tip, top_displacement, top_tip
   use step_measures, only: greatest_in, part_of, piece_t
   implicit none (type, external)
   private
   public :: open_statistics, take_step

contains

   !> Begin a run.
   subroutine open_statistics(settings, run)
      !> With statistics
      type(run_settings_t), intent(in) :: settings
      !> Its surfaces are there
      type(newmark_run_t), intent(inout) :: run

      logical :: yields(size(run%contacts))
      integer :: k, pulled

      do k = 1, size(run%contacts)
         yields(run%contacts(k)%surface%number) = allocated(run%contacts(k)%stop)
      end do
      pulled = 0
      if (run%pulled > 0) pulled = run%contacts(run%pulled)%surface%number
      allocate (run%blocks)
      call open_blocks(settings, yields, pulled, run%blocks)
      run%blocks%hop_tolerance = run%hop_height
   end subroutine open_statistics

   !> The step just accepted, which is cut where a block ends.
   pure subroutine take_step(run, from, step)
      !> With blocks
      type(newmark_run_t), intent(inout) :: run
      !> Its beginning and length
      real(wp), intent(in) :: from
      real(wp), intent(in) :: step

      type(piece_t) :: piece
      real(wp) :: begin, end
      integer :: block, k, last

      last = ubound(run%blocks%edge, 1)
      do block = max(blocks_begun(run%blocks, from), 1), last
         begin = max(run%blocks%edge(block - 1), from)
         end = min(run%blocks%edge(block), from + step)
         if (end > begin) call take_part(run, from, step, (begin - from)/step, (end - from)/step, block)
         if (run%blocks%edge(block) >= from + step) exit
      end do
      do k = 1, size(run%contacts)
         associate (contact => run%contacts(k))
            associate (surface => run%blocks%surface(contact%surface%number), sign => contact%row%sign)
               if (contact%status == is_held .or. contact%status == is_in_contact) then
                  ! contact lasts, and no impact begins, whatever counts of it
                  call take_contact(surface, from, from + step, 0, [0.0_wp, 0.0_wp], 0.0_wp)
               else if (.not. surface%has_flown) then
                  piece = motion_of(run, from, step, contact%row%dof)
                  piece%eta = sign*piece%eta - contact%surface%height
                  piece%rate = sign*piece%rate
                  call take_flight(surface, greatest_in(piece), run%blocks%hop_tolerance)
               end if
            end associate
         end associate
      end do
   end subroutine take_step

   !> The part of a step within one block.
   pure subroutine take_part(run, from, step, begin, end, block)
      type(newmark_run_t), intent(inout) :: run
      real(wp), intent(in) :: from
      real(wp), intent(in) :: step
      !> As shares of the step
      real(wp), intent(in) :: begin
      real(wp), intent(in) :: end
      integer, intent(in) :: block

      type(piece_t) :: piece
      real(wp) :: force(2), integrals(2), length
      integer :: k

      length = (end - begin)*step
      piece = part_of(motion_of(run, from, step, run%stepper%tip_dof), begin, end)
      associate (sums => run%blocks%tip%sums(:, block))
         sums([sum_tip, sum_square_tip]) = sums([sum_tip, sum_square_tip]) + integrals_of(piece)
         call extend(piece, sums(low_tip), sums(top_tip))
      end associate
      do k = 1, size(run%contacts)
         associate (contact => run%contacts(k), surface => run%blocks%surface(run%contacts(k)%surface%number))
            piece = part_of(motion_of(run, from, step, contact%row%dof), begin, end)
            associate (sums => surface%sums(:, block))
               sums([sum_displacement, sum_square_displacement]) = sums([sum_displacement, sum_square_displacement]) &
                  + integrals_of(piece)
               call extend(piece, sums(low_displacement), sums(top_displacement))
            end associate
            if (.not. (contact%status == is_held .or. contact%status == is_in_contact)) cycle
            associate (old => run%states(3 - run%now)%force(k), new => run%states(run%now)%force(k))
               force = old + [begin, end]*(new - old)
            end associate
            integrals = length*[0.5_wp*sum(force), (sum(force**2) + product(force))/3.0_wp]
            call take_contact(surface, from + begin*step, from + end*step, block, integrals, &
               maxval(force))
         end associate
      end do
   end subroutine take_part

   !> How a degree of freedom goes through the step.
   pure function motion_of(run, from, step, dof) result(piece)
      type(newmark_run_t), intent(in) :: run
      !> Beginning and length of the step
      real(wp), intent(in) :: from
      real(wp), intent(in) :: step
      integer, intent(in) :: dof
      type(piece_t) :: piece

      associate (old => run%states(3 - run%now)%beam, new => run%states(run%now)%beam)
         piece = piece_t(from, step, [old%displacement(dof), new%displacement(dof)], &
            [old%velocity(dof), new%velocity(dof)])
      end associate
   end function motion_of

   !> Of a cubic and its square, with weights of Hermite's shapes.
   pure function integrals_of(piece) result(integrals)
      type(piece_t), intent(in) :: piece
      real(wp) :: integrals(2)

      real(wp) :: a(4), rate(2)
      real(wp), parameter :: mass(4, 4) = reshape([156.0_wp, 22.0_wp, 54.0_wp, -13.0_wp, 22.0_wp, 4.0_wp, 13.0_wp, &
         -3.0_wp, 54.0_wp, 13.0_wp, 156.0_wp, -22.0_wp, -13.0_wp, -3.0_wp, -22.0_wp, 4.0_wp], [4, 4])/420.0_wp

      rate = piece%length*piece%rate
      a = [piece%eta(1), rate(1), piece%eta(2), rate(2)]
      integrals = piece%length*[0.5_wp*sum(piece%eta) + (rate(1) - rate(2))/12.0_wp, dot_product(a, matmul(mass, a))]
   end function integrals_of

   !> Its extremes.
   pure subroutine extend(piece, least, greatest)
      type(piece_t), intent(in) :: piece
      real(wp), intent(inout) :: least
      real(wp), intent(inout) :: greatest

      greatest = max(greatest, greatest_in(piece))
      least = min(least, -greatest_in(piece_t(piece%from, piece%length, -piece%eta, -piece%rate)))
   end subroutine extend

end module newmark_statistics
